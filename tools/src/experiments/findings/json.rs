//! Numbers of rows in JSON, which has no words for those that are none: they are written as text, so that a criterion sees them.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number, or the text of one that JSON cannot write.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Number(f64),
    Text(String),
}

/// How a type of a row's field is written; types other than numbers are written as they are.
pub trait Field: Sized {
    /// Writes it.
    ///
    /// # Errors
    /// The serializer's.
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error>;

    /// Reads it.
    ///
    /// # Errors
    /// The deserializer's, and text that is no number.
    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error>;
}

fn written(number: f64) -> Written {
    if number.is_finite() {
        Written::Number(number)
    } else {
        Written::Text(number.to_string())
    }
}

fn number<E: serde::de::Error>(written: Written) -> Result<f64, E> {
    match written {
        Written::Number(number) => Ok(number),
        Written::Text(text) => text.parse().map_err(E::custom),
    }
}

impl Field for f64 {
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        written(*self).serialize(serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        number(Written::deserialize(deserializer)?)
    }
}

impl Field for Option<f64> {
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.map(written).serialize(serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Option::<Written>::deserialize(deserializer)?.map(number).transpose()
    }
}

impl Field for super::Repeats {
    fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let values: Vec<Written> = self.0.iter().copied().map(written).collect();
        values.serialize(serializer)
    }

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Vec::<Written>::deserialize(deserializer)?
            .into_iter()
            .map(number)
            .collect::<Result<Vec<f64>, _>>()
            .map(Self)
    }
}

macro_rules! as_they_are {
    ($($type:ty),*) => {
        $(
            impl Field for $type {
                fn write<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                    self.serialize(serializer)
                }

                fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                    Self::deserialize(deserializer)
                }
            }
        )*
    };
}
as_they_are!(String, u64);
