//! The command line of Planish.

fn main() {}
