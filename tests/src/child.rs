//! Tests run again in processes of their own, under another environment: software drivers read their number of threads when a process begins.

use std::process::Command;

/// 64-bit FNV-1a of words, byte by byte.
pub fn hash_of(words: impl IntoIterator<Item = u32>) -> u64 {
    words
        .into_iter()
        .flat_map(u32::to_le_bytes)
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        })
}

/// Prints the hash of words as [`hash_in_child`] reads it.
pub fn print_hash(words: impl IntoIterator<Item = u32>) {
    println!("hash {:016x}", hash_of(words));
}

/// What the test `test` of this program prints behind `hash ` when it runs alone with the variable `asked` set, and these besides; panics
/// where it fails or prints none.
pub fn hash_in_child(test: &str, asked: &str, variables: &[(&str, &str)]) -> String {
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test, "--nocapture"])
        .env(asked, "1")
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.success(),
        "{variables:?}: {text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let line = text.lines().find_map(|line| line.split_once("hash "));
    line.unwrap_or_else(|| panic!("{variables:?}: no hash in {text}"))
        .1
        .to_owned()
}
