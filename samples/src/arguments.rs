//! Command lines of the samples: names with one value each, and what stands alone.

use std::str::FromStr;

use clerestory::{Error, Result};

/// A command line taken apart.
#[derive(Debug, Default)]
pub struct Arguments {
    named: Vec<(String, String)>,
    alone: Vec<String>,
}

impl Arguments {
    /// Takes apart this process's command line; `names` are the options there are, with their dashes, and at most `alone` arguments
    /// may stand without one.
    ///
    /// # Errors
    /// [`Error::Setting`] for an option that is unknown or without a value, and for an argument too many.
    pub fn of_process(names: &[&str], alone: usize) -> Result<Self> {
        Self::parse(std::env::args().skip(1), names, alone)
    }

    fn parse(mut words: impl Iterator<Item = String>, names: &[&str], alone: usize) -> Result<Self> {
        let mut arguments = Self::default();
        while let Some(word) = words.next() {
            if !word.starts_with("--") {
                arguments.alone.push(word);
                continue;
            }
            let value = words.next();
            let known = names.contains(&word.as_str());
            match value {
                Some(value) if known => arguments.named.push((word, value)),
                _ => {
                    let cause = if known { "needs a value".into() } else { unknown(names) };
                    return Err(wrong(&word, &value.unwrap_or_default(), cause));
                }
            }
        }
        match arguments.alone.get(alone) {
            Some(word) => Err(wrong("argument", word, "is one too many".into())),
            None => Ok(arguments),
        }
    }

    /// The argument at this place among those without a name.
    pub fn alone(&self, index: usize) -> Option<&str> {
        self.alone.get(index).map(String::as_str)
    }

    /// The value of an option as given; of several the last.
    pub fn text(&self, name: &str) -> Option<&str> {
        let given = self.named.iter().rev().find(|(known, _)| known == name);
        given.map(|(_, value)| value.as_str())
    }

    /// The value of an option as a number or whatever `T` is.
    ///
    /// # Errors
    /// [`Error::Setting`] when it does not parse.
    pub fn value<T: FromStr>(&self, name: &str) -> Result<Option<T>> {
        self.parsed(name, "is not a value for it", |text| text.parse().ok())
    }

    /// The value of an option as a width and a height, such as `800x600`.
    ///
    /// # Errors
    /// [`Error::Setting`] when it is not.
    pub fn size(&self, name: &str) -> Result<Option<[u32; 2]>> {
        self.parsed(name, "is not a size such as 800x600", |text| {
            let (width, height) = text.split_once('x')?;
            let size = [width.parse().ok()?, height.parse().ok()?];
            (!size.contains(&0)).then_some(size)
        })
    }

    fn parsed<T>(&self, name: &str, cause: &str, parse: impl Fn(&str) -> Option<T>) -> Result<Option<T>> {
        let Some(text) = self.text(name) else { return Ok(None) };
        parse(text).map(Some).ok_or_else(|| wrong(name, text, cause.into()))
    }
}

fn unknown(names: &[&str]) -> String {
    format!("is unknown; there is: {}", names.join(", "))
}

fn wrong(name: &str, value: &str, cause: String) -> Error {
    Error::Setting {
        name: name.into(),
        value: value.into(),
        cause,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<Arguments> {
        Arguments::parse(line.split_whitespace().map(str::to_owned), &["--size", "--spp"], 1)
    }

    #[test]
    fn options_and_words_are_told_apart() -> Result<()> {
        let arguments = parse("--spp 4 scene.gltf --size 30x20 --spp 5")?;
        assert_eq!(arguments.alone(0), Some("scene.gltf"));
        assert_eq!(arguments.value::<u32>("--spp")?, Some(5));
        assert_eq!(arguments.size("--size")?, Some([30, 20]));
        assert_eq!(parse("")?.value::<u32>("--spp")?, None);
        Ok(())
    }

    #[test]
    fn mistakes_are_named() {
        let message = |line| {
            parse(line)
                .map(|_| ())
                .err()
                .map(|error| error.to_string())
                .unwrap_or_default()
        };
        assert!(message("--colour red").contains("--size, --spp"));
        assert!(message("--spp").contains("needs a value"));
        assert!(message("a b").contains("one too many"));
        for line in ["--size wide", "--size 0x3", "--size 3"] {
            assert!(parse(line).and_then(|a| a.size("--size")).is_err(), "{line}");
        }
        assert!(parse("--spp -1").and_then(|a| a.value::<u32>("--spp")).is_err());
    }
}
