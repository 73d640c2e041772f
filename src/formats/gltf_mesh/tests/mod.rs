//! What is read, what is refused, and that nothing makes the reader panic.

mod build;
mod features;
mod lies;
