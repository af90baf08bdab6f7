//! What a setting may be: ranges that check a value and say themselves in words.

use std::fmt::Display;
use std::ops::{Range, RangeFrom, RangeInclusive};

use serde::de::{DeserializeOwned, Deserializer, Error as _, Visitor};

/// Values that a setting of type `T` may have.
pub trait Allowed<T> {
    /// The value as text if it is none of these.
    fn refused(&self, value: &T) -> Option<String>;

    /// These values in words: `0 … 4096`.
    fn text(&self) -> String;

    /// Their names in JSON, where they have some.
    fn names(&self) -> Vec<&'static str> {
        Vec::new()
    }
}

/// What has an order and can be out of range.
pub trait Number: PartialOrd + Display {
    /// False for infinities and what is not a number.
    fn is_finite(&self) -> bool {
        true
    }
}

impl Number for u32 {}

impl Number for f32 {
    fn is_finite(&self) -> bool {
        f32::is_finite(*self)
    }
}

/// The value as text unless it is finite and fits.
fn unless<N: Number>(fits: bool, value: &N) -> Option<String> {
    (!(fits && value.is_finite())).then(|| value.to_string())
}

impl<N: Number> Allowed<N> for RangeInclusive<N> {
    fn refused(&self, value: &N) -> Option<String> {
        unless(self.contains(value), value)
    }

    fn text(&self) -> String {
        format!("{} … {}", self.start(), self.end())
    }
}

impl<N: Number> Allowed<N> for Range<N> {
    fn refused(&self, value: &N) -> Option<String> {
        unless(self.contains(value), value)
    }

    fn text(&self) -> String {
        format!("{} or more, below {}", self.start, self.end)
    }
}

impl<N: Number> Allowed<N> for RangeFrom<N> {
    fn refused(&self, value: &N) -> Option<String> {
        unless(self.contains(value), value)
    }

    fn text(&self) -> String {
        format!("{} or more", self.start)
    }
}

/// Finite values greater than this one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Above<N>(pub N);

impl<N: Number> Allowed<N> for Above<N> {
    fn refused(&self, value: &N) -> Option<String> {
        unless(*value > self.0, value)
    }

    fn text(&self) -> String {
        format!("above {}", self.0)
    }
}

/// Values greater than the first, up to the second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AboveTo<N>(pub N, pub N);

impl<N: Number> Allowed<N> for AboveTo<N> {
    fn refused(&self, value: &N) -> Option<String> {
        unless(*value > self.0 && *value <= self.1, value)
    }

    fn text(&self) -> String {
        format!("above {}, at most {}", self.0, self.1)
    }
}

/// A range, or 0, which usually stands for none or for a choice of the technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrZero<R>(pub R);

impl<N: Number + Default, R: Allowed<N>> Allowed<N> for OrZero<R> {
    fn refused(&self, value: &N) -> Option<String> {
        self.0.refused(value).filter(|_| *value != N::default())
    }

    fn text(&self) -> String {
        format!("0, or {}", self.0.text())
    }
}

/// Whatever the type reads, in these words.
impl<T> Allowed<T> for &str {
    fn refused(&self, _: &T) -> Option<String> {
        None
    }

    fn text(&self) -> String {
        (*self).to_owned()
    }
}

/// Every value of the type: `true | false`, or the names of an enum as serde has them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnyValue;

impl<T: DeserializeOwned> Allowed<T> for AnyValue {
    fn refused(&self, _: &T) -> Option<String> {
        None
    }

    fn text(&self) -> String {
        Allowed::<T>::names(self).join(" | ")
    }

    fn names(&self) -> Vec<&'static str> {
        let mut names = Names(Vec::new());
        // It always ends in an error: only what the type asks for is looked at.
        let _ = T::deserialize(&mut names);
        names.0
    }
}

/// A source of values that notes which ones are asked for, and has none.
struct Names(Vec<&'static str>);

impl<'de> Deserializer<'de> for &mut Names {
    type Error = serde::de::value::Error;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Self::Error> {
        Err(Self::Error::custom("there is no value"))
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        self.0 = vec!["true", "false"];
        self.deserialize_any(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        self.0 = variants.to_vec();
        self.deserialize_any(visitor)
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct newtype_struct seq tuple
        tuple_struct map struct identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_keep_their_ends_and_say_so() {
        let words = |range: &dyn Allowed<f32>, value| (range.text(), range.refused(&value).is_none());
        let cases: [(&dyn Allowed<f32>, f32, &str, bool); 12] = [
            (&(0.0..=1.0), 1.0, "0 … 1", true),
            (&(0.0..1.0), 1.0, "0 or more, below 1", false),
            (&(0.0..1.0), 0.0, "0 or more, below 1", true),
            (&(0.0..), f32::INFINITY, "0 or more", false),
            (&(0.0..), 1e30, "0 or more", true),
            (&Above(0.0), 0.0, "above 0", false),
            (&Above(0.0), f32::INFINITY, "above 0", false),
            (&AboveTo(0.0, 0.999), 0.999, "above 0, at most 0.999", true),
            (&AboveTo(0.0, 0.999), 0.0, "above 0, at most 0.999", false),
            (&AboveTo(0.0, 0.999), f32::NAN, "above 0, at most 0.999", false),
            (&OrZero(2.0..=3.0), 0.0, "0, or 2 … 3", true),
            (&OrZero(2.0..=3.0), 1.0, "0, or 2 … 3", false),
        ];
        for (range, value, text, fits) in cases {
            assert_eq!(words(range, value), (text.to_owned(), fits), "{value}");
        }
        assert_eq!((1..=4u32).refused(&5).as_deref(), Some("5"));
    }

    #[test]
    fn enums_list_their_names() {
        #[derive(serde::Deserialize)]
        #[serde(rename_all = "snake_case")]
        #[allow(dead_code)]
        enum Order {
            FromLeft,
            FromRight,
        }
        assert_eq!(Allowed::<Order>::text(&AnyValue), "from_left | from_right");
        assert_eq!(Allowed::<bool>::text(&AnyValue), "true | false");
    }
}
