//! Settings: declared once by [`settings!`](crate::settings!), given as a struct or as JSON, with errors that name the setting at fault.
//!
//! A technique declares a struct; its [`Card`](crate::techniques::Card) keeps [`SettingsDecl::of`] that type. Whoever makes the technique
//! gets [`Settings`], and [`read`](Settings::read)s them as the struct.

#[doc(hidden)]
pub mod declare;
mod given;
mod macros;
mod range;

pub use declare::{SettingInfo, SettingsDecl, TypedSettings};
pub use given::Settings;
pub use range::{Above, AboveTo, Allowed, AnyValue, Number, OrZero};
#[doc(hidden)]
pub use serde;
#[doc(hidden)]
pub use serde_json::Value;

/// Longest value that an error repeats, in characters.
const SHOWN: usize = 60;

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

/// The number that was typed for an f32, 0.95 for instance, not the f64 of the same value (0.949999988079071): the shortest decimal that reads
/// back as this f32.
fn typed_number(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| value.into())
}
