//! Fields of rows: how they are shown in a cell, and how they are written as JSON, which has no words for numbers that are none. Those are written
//! as text, so that a criterion sees them.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::{Measured, Repeats};
use crate::experiments::table::Cell;

/// What a row may hold.
pub trait Field: Serialize + DeserializeOwned {
    /// The cell that shows it.
    fn cell(&self) -> Cell;

    /// Writes it.
    ///
    /// # Errors
    /// The serializer's.
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.serialize(serializer)
    }

    /// Reads it.
    ///
    /// # Errors
    /// The deserializer's, and text that is not a number.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::deserialize(deserializer)
    }
}

/// A number, or the text of one that JSON cannot write.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Text(String),
}

impl From<&f64> for Written {
    fn from(number: &f64) -> Self {
        if number.is_finite() {
            Self::Number(*number)
        } else {
            Self::Text(number.to_string())
        }
    }
}

fn number<E: serde::de::Error>(written: Written) -> Result<f64, E> {
    match written {
        Written::Number(number) => Ok(number),
        Written::Text(text) => text.parse().map_err(E::custom),
    }
}

/// A number of any value, for `#[serde(with)]`.
pub(super) mod any_number {
    use super::{Deserialize, Deserializer, Serialize, Serializer, Written, number};

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        Written::from(value).serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        number(Written::deserialize(deserializer)?)
    }
}

/// Numbers of any values, for `#[serde(with)]`.
pub(super) mod any_numbers {
    use super::{Deserialize, Deserializer, Serializer, Written, number};

    pub fn serialize<S: Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(values.iter().map(Written::from))
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
        let all = Vec::<Written>::deserialize(deserializer)?;
        all.into_iter().map(number).collect()
    }
}

impl Field for f64 {
    fn cell(&self) -> Cell {
        (*self).into()
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        any_number::serialize(self, serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        any_number::deserialize(deserializer)
    }
}

impl Field for Option<f64> {
    fn cell(&self) -> Cell {
        (*self).into()
    }

    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.as_ref().map(Written::from).serialize(serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Option::<Written>::deserialize(deserializer)?.map(number).transpose()
    }
}

macro_rules! fields {
    ($($type:ty: |$value:ident| $cell:expr;)*) => {
        $(
            impl Field for $type {
                fn cell(&self) -> Cell {
                    let $value = self;
                    $cell
                }
            }
        )*
    };
}
fields! {
    String: |text| text.as_str().into();
    u64: |count| (*count).into();
    bool: |is_so| if *is_so { "yes" } else { "no" }.into();
    Measured: |found| (*found).into();
    Repeats: |repeats| repeats.measured().into();
    Option<String>: |text| text.as_deref().into();
    Option<u64>: |count| (*count).into();
    Option<Measured>: |found| (*found).into();
    Option<Repeats>: |repeats| repeats.as_ref().map(Repeats::measured).into();
}
