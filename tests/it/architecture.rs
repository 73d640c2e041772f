//! The layer rule: each floor imports only floors below it, and `engine/` stays pure.

use std::fs;
use std::path::{Path, PathBuf};

fn sources(dir: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<_> =
        fs::read_dir(dir).expect("a source folder").map(|e| e.expect("an entry").path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Lines of the files under `floor` that name one of `forbidden`, comments, documentation and tests aside: tests beside
/// the code may read reference cases.
fn offences(floor: &str, forbidden: &[&str]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(floor);
    let mut files = Vec::new();
    if root.is_dir() {
        sources(&root, &mut files);
    } else {
        files.push(root.with_extension("rs"));
    }
    assert!(!files.is_empty(), "no sources under src/{floor}");
    let mut found = Vec::new();
    for file in files {
        if is_of_tests(&file) {
            continue;
        }
        let text = fs::read_to_string(&file).expect("a readable source file");
        let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or(&text);
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            if let Some(word) = forbidden.iter().find(|word| code.contains(**word)) {
                found.push(format!("{}:{}: {word}", file.display(), number + 1));
            }
        }
    }
    found
}

/// Files that are compiled for tests alone: a folder `tests`, or a name that says so.
fn is_of_tests(file: &Path) -> bool {
    let named =
        |part: &str| part == "tests" || part == "tests.rs" || part.starts_with("test_") || part.ends_with("_tests.rs");
    file.components().any(|part| named(&part.as_os_str().to_string_lossy()))
}

#[test]
fn the_engine_is_pure_geometry() {
    let found = offences(
        "engine",
        &[
            "crate::api",
            "crate::queue",
            "crate::store",
            "crate::formats",
            "crate::server",
            "tokio::",
            "sqlx::",
            "axum::",
            "tracing::error!",
            "tracing::warn!",
            "tracing::info!",
            "tracing::debug!",
            "tracing::instrument",
            "std::fs",
            "std::net",
            "std::thread",
            "std::time::Instant",
            "SystemTime",
        ],
    );
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn formats_know_neither_store_nor_queue_nor_http() {
    let found =
        offences("formats", &["crate::api", "crate::queue", "crate::store", "crate::server", "axum::", "sqlx::"]);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_store_knows_neither_geometry_nor_http() {
    let found = offences("store", &["crate::api", "crate::queue", "crate::engine", "crate::server", "axum::"]);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn the_queue_knows_no_http() {
    let found = offences("queue", &["crate::api", "crate::server", "axum::", "sqlx::"]);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn sql_is_spoken_in_the_store_alone() {
    for floor in ["api", "queue", "formats", "engine"] {
        let found = offences(floor, &["sqlx::", "sqlx_"]);
        assert!(found.is_empty(), "{found:#?}");
    }
}
