//! Makes the sample parts of `examples/parts/`: `cargo run --example make_parts`.
//!
//! Every part is built from formulae with the library's own types and written as trimmed-surface JSON that can be sent as
//! it stands: `curl --data-binary @examples/parts/car-glass.json 'http://localhost:8080/v1/flatten?format=svg'`.

#![expect(
    clippy::expect_used,
    reason = "the formulae are constants: what they make is valid, and a slip shows at the first run"
)]

mod parts;
mod shapes;
mod trims;

use std::path::Path;

fn main() -> std::io::Result<()> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/parts");
    std::fs::create_dir_all(&folder)?;
    for part in parts::all() {
        std::fs::write(folder.join(part.file), part.json())?;
    }
    Ok(())
}
