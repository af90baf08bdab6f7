//! Hashes by which what is kept on disk is known again.
//!
//! FNV-1a with 128 bits (Fowler, Noll and Vo; Internet draft draft-eastlake-fnv), the same on every machine and with every compiler. It guards against
//! what has changed, not against who would deceive.

const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

/// A hash in the making; text goes in by `write!`.
#[derive(Debug, Clone, Copy)]
pub struct Fingerprint(u128);

impl Default for Fingerprint {
    fn default() -> Self {
        Self(OFFSET)
    }
}

impl Fingerprint {
    /// The hash of some bytes, as hexadecimal digits.
    pub fn of(bytes: &[u8]) -> String {
        let mut print = Self::default();
        print.add(bytes);
        print.text()
    }

    /// Takes bytes in.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0 = bytes
            .iter()
            .fold(self.0, |hash, byte| (hash ^ u128::from(*byte)).wrapping_mul(PRIME));
    }

    /// The hash, lowest byte first.
    pub fn bytes(self) -> [u8; 16] {
        self.0.to_le_bytes()
    }

    /// 32 hexadecimal digits.
    pub fn text(self) -> String {
        format!("{:032x}", self.0)
    }
}

impl std::fmt::Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        self.add(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_are_the_published_ones() {
        // Test vectors of the draft for the empty string, "a" and "foobar".
        assert_eq!(Fingerprint::of(b""), "6c62272e07bb014262b821756295c58d");
        assert_eq!(Fingerprint::of(b"a"), "d228cb696f1a8caf78912b704e4a8964");
        assert_eq!(Fingerprint::of(b"foobar"), "343e1662793c64bf6f0d3597ba446f18");
    }
}
