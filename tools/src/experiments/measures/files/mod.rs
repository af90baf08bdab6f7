//! Files that others wrote.

pub mod fuzzing;
