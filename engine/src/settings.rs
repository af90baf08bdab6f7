//! Settings as text: JSON in, JSON out, and errors that name the setting at fault.

use serde::Serializer;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::{Error, Result};

/// Longest value that an error repeats, in characters.
const SHOWN: usize = 60;

/// Settings of type `T` from a JSON object; what it leaves out, or `null` in its place, takes the defaults.
///
/// `T` is expected to be marked `#[serde(default, deny_unknown_fields)]`.
///
/// # Errors
/// [`Error::Setting`] with the name of the setting that is unknown or has a value that does not fit.
pub fn from_json<T: DeserializeOwned + Default>(json: &Value) -> Result<T> {
    if json.is_null() {
        return Ok(T::default());
    }
    let Value::Object(object) = json else {
        return Err(Error::setting("settings", shown(json), "is no JSON object"));
    };
    serde_json::from_value(json.clone()).map_err(|error| {
        // Each setting alone, to tell which one it was.
        let culprit = object.iter().find_map(|(name, value)| {
            let alone = Value::Object(std::iter::once((name.clone(), value.clone())).collect());
            let error = serde_json::from_value::<T>(alone).err()?.to_string();
            // Serde repeats a value in full.
            let error = error.replace(&value.to_string(), &shown(value));
            Some(Error::setting(name, shown(value), format!("does not fit: {error}")))
        });
        culprit.unwrap_or_else(|| Error::setting("settings", "object", format!("does not fit: {error}")))
    })
}

/// A value in few words.
fn shown(value: &Value) -> String {
    match value {
        Value::Object(_) => "object".into(),
        Value::Array(_) => "array".into(),
        other => {
            let text = other.to_string();
            if text.chars().count() <= SHOWN {
                text
            } else {
                text.chars().take(SHOWN).chain(['…']).collect()
            }
        }
    }
}

/// For `#[serde(serialize_with = "…")]`: an f32 as it was typed (0.95), not as the f64 of the same value (0.949999988079071).
///
/// # Errors
/// The serializer's.
pub fn serialize_f32<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    // The shortest decimal that reads back as this f32.
    match value.to_string().parse::<f64>() {
        Ok(typed) => serializer.serialize_f64(typed),
        Err(_) => serializer.serialize_f32(*value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[derive(Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(default, deny_unknown_fields)]
    struct Two {
        #[serde(serialize_with = "serialize_f32")]
        share: f32,
        count: u32,
    }

    #[test]
    fn numbers_print_as_typed_and_read_back_to_the_bit() {
        for share in [0.95, 0.1, 1e-7, 3.4e38, 0.333_333_34, 16_777_216.0, 0.0] {
            let text = serde_json::to_string(&Two { share, count: 1 }).unwrap();
            let back: Two = from_json(&serde_json::from_str(&text).unwrap()).unwrap();
            assert_eq!(back.share.to_bits(), share.to_bits(), "{text}");
        }
        let json = serde_json::to_value(Two { share: 0.95, count: 1 }).unwrap();
        assert_eq!(json, json!({"share": 0.95, "count": 1}));
    }

    #[test]
    fn errors_name_the_setting_and_repeat_no_more_than_its_value() {
        let long = "x".repeat(1000);
        for (json, name, value) in [
            (json!({"share": 0.5, "count": -1}), "count", "-1"),
            (json!({"share": 0.5, "cuont": 1}), "cuont", "1"),
            (json!({"share": {"a": 1}}), "share", "object"),
            (json!([1, 2]), "settings", "array"),
            (json!({"share": 0.5, "count": long}), "count", "\"xxx"),
        ] {
            let text = from_json::<Two>(&json).unwrap_err().to_string();
            assert!(text.starts_with(&format!("setting {name}: {value}")), "{text}");
            assert!(!text.contains("0.5") && text.len() < 200 + 2 * SHOWN, "{text}");
        }
        assert_eq!(from_json::<Two>(&Value::Null).unwrap(), Two::default());
    }
}
