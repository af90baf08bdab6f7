//! The command line program of the Clerestory rendering engine.
fn main() {}
