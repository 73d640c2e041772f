//! Tables as text: Markdown with aligned columns, so that they read as they are and can be pasted.

/// The rows that carry the thesis's figures and ours.
pub(crate) const THESIS: &str = "thesis";
pub(crate) const OURS: &str = "ours";

/// Stands where one side has no figure.
pub(crate) const NONE: &str = "-";

/// A table that is being filled.
pub(crate) struct Table {
    title: String,
    rows: Vec<Vec<String>>,
}

impl Table {
    pub(crate) fn new(title: &str, head: &[&str]) -> Self {
        Self { title: title.to_owned(), rows: vec![head.iter().map(|&cell| cell.to_owned()).collect()] }
    }

    /// Adds a row of what can be written.
    pub(crate) fn row<T: ToString>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(|cell| cell.to_string()).collect());
    }

    /// Adds a row that begins with labels and goes on with figures.
    pub(crate) fn labelled<T: ToString>(&mut self, labels: &[&str], figures: impl IntoIterator<Item = T>) {
        let figures = figures.into_iter().map(|figure| figure.to_string());
        self.row(labels.iter().map(|&label| label.to_owned()).chain(figures));
    }

    /// Writes the table to standard output: the first column to the left, the others to the right.
    pub(crate) fn print(&self) {
        let columns = self.rows[0].len();
        let width = |k: usize| self.rows.iter().filter_map(|row| row.get(k)).map(|cell| cell.chars().count()).max();
        let widths: Vec<usize> = (0..columns).map(|k| width(k).unwrap_or(0).max(3)).collect();
        println!("\n### {}\n", self.title);
        for (number, row) in self.rows.iter().enumerate() {
            let cells = (0..columns).map(|k| {
                let cell = row.get(k).map_or("", String::as_str);
                let width = widths[k];
                if k == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
            println!("| {} |", cells.collect::<Vec<_>>().join(" | "));
            if number == 0 {
                let rules = widths
                    .iter()
                    .enumerate()
                    .map(|(k, &width)| if k == 0 { "-".repeat(width) } else { format!("{}:", "-".repeat(width - 1)) });
                println!("| {} |", rules.collect::<Vec<_>>().join(" | "));
            }
        }
    }
}

/// Says something below a table.
pub(crate) fn note(text: &str) {
    println!("\n{text}");
}

/// A figure with about three digits: tiny ones with their power of ten.
pub(crate) fn figure(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 {
        "0".to_owned()
    } else if size < 1e-4 {
        format!("{x:.2e}")
    } else {
        let decimals = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
        format!("{x:.decimals$}")
    }
}

/// `None` as a dash.
pub(crate) fn figure_or_none(x: Option<f64>) -> String {
    x.map_or_else(|| NONE.to_owned(), figure)
}
