//! The macro that declares settings.

/// Declares the settings of a technique, once: the struct with its documentation and defaults, JSON both ways, the check of ranges, help and
/// errors.
///
/// A field is `pub name: Type = default, in RANGE, unit "…";`. The first paragraph of its documentation is the help's text. Ranges are
/// `a..=b`, `a..b`, `a..`, [`Above`](crate::settings::Above), [`AboveTo`](crate::settings::AboveTo),
/// [`OrZero`](crate::settings::OrZero) of one of these, or words for what its type checks as it reads; without one, every value of the type
/// is allowed, as for `bool` and enums, whose names serde knows. `in` and `unit` may be left out. Fields under `unlisted` are for hosts that
/// pass the struct: they are neither in JSON nor in help. What concerns several settings is checked by `check FUNCTION;`, a
/// `fn(&Self) -> Result<()>`.
///
/// ```
/// use clerestory::settings::TypedSettings;
///
/// clerestory::settings! {
///     /// Settings of occlusion.
///     pub struct OcclusionSettings {
///         /// Rays of each pixel and frame; more have less noise.
///         pub rays: u32 = 4, in 1..=256, unit "rays";
///         /// Farthest surface that shades; 0 for all. Changes the picture.
///         pub reach: f32 = 0.0, in 0.0.., unit "m";
///         /// Weights rays by the cosine; changes the noise only.
///         pub by_cosine: bool = true;
///     }
///     unlisted {
///         /// Seed of the random numbers.
///         pub seed: u32 = 0;
///     }
/// }
///
/// let settings = OcclusionSettings { rays: 0, ..Default::default() };
/// assert_eq!(
///     settings.check().unwrap_err().to_string(),
///     "setting rays: 0 is out of range; it may be 1 … 256 (rays)"
/// );
/// let read = OcclusionSettings::from_json(&serde_json::json!({ "reach": 0.5 }))?;
/// assert_eq!((read.rays, read.reach), (4, 0.5));
/// assert_eq!(OcclusionSettings::infos()[0].meaning, "Rays of each pixel and frame; more have less noise");
/// # Ok::<(), clerestory::Error>(())
/// ```
#[macro_export]
macro_rules! settings {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $name:ident {
            $(
                $(#[doc = $doc:literal])*
                pub $field:ident: $type:ty = $default:expr $(, in $range:expr)? $(, unit $unit:literal)? ;
            )*
        }
        $(unlisted {
            $(
                $(#[doc = $hidden_doc:literal])*
                pub $hidden:ident: $hidden_type:ty = $hidden_default:expr $(, in $hidden_range:expr)? ;
            )*
        })?
        $(check $check:expr;)?
    ) => {
        $(#[$attribute])*
        #[derive(Debug, Clone, PartialEq)]
        $visibility struct $name {
            $(
                $(#[doc = $doc])*
                #[doc = concat!(
                    "\n\nDefault `", stringify!($default), "`",
                    $("; in `", stringify!($range), "`",)? $("; ", $unit,)? "."
                )]
                pub $field: $type,
            )*
            $($(
                $(#[doc = $hidden_doc])*
                #[doc = concat!(
                    "\n\nDefault `", stringify!($hidden_default), "`",
                    $("; in `", stringify!($hidden_range), "`",)? ". Not in JSON."
                )]
                pub $hidden: $hidden_type,
            )*)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self {
                    $($field: $default,)*
                    $($($hidden: $hidden_default,)*)?
                }
            }
        }

        impl $crate::settings::TypedSettings for $name {
            fn infos() -> Vec<$crate::settings::SettingInfo> {
                let defaults = Self::default();
                vec![$(
                    $crate::settings::declare::info(
                        stringify!($field),
                        &defaults.$field,
                        &$crate::__settings_or!($crate::settings::AnyValue $(, $range)?),
                        $crate::__settings_or!("" $(, $unit)?),
                        concat!($($doc, "\n"),*),
                    ),
                )*]
            }

            fn to_json(&self) -> $crate::settings::Value {
                $crate::settings::Value::Object(
                    [$((stringify!($field).to_owned(), $crate::settings::declare::write(&self.$field))),*]
                        .into_iter()
                        .collect(),
                )
            }

            #[allow(unused_variables)]
            fn set(&mut self, name: &str, value: &$crate::settings::Value) -> $crate::Result<bool> {
                $(
                    if name == stringify!($field) {
                        self.$field = $crate::settings::declare::read(
                            name,
                            value,
                            &$crate::__settings_or!($crate::settings::AnyValue $(, $range)?),
                            $crate::__settings_or!("" $(, $unit)?),
                        )?;
                        return Ok(true);
                    }
                )*
                Ok(false)
            }

            fn check(&self) -> $crate::Result<()> {
                $(
                    $crate::settings::declare::check(
                        stringify!($field),
                        &self.$field,
                        &$crate::__settings_or!($crate::settings::AnyValue $(, $range)?),
                        $crate::__settings_or!("" $(, $unit)?),
                    )?;
                )*
                $($($(
                    $crate::settings::declare::check(stringify!($hidden), &self.$hidden, &$hidden_range, "")?;
                )?)*)?
                $($check(self)?;)?
                Ok(())
            }
        }

        impl $crate::settings::serde::Serialize for $name {
            fn serialize<S: $crate::settings::serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                $crate::settings::serde::Serialize::serialize(
                    &$crate::settings::TypedSettings::to_json(self),
                    serializer,
                )
            }
        }

        impl<'de> $crate::settings::serde::Deserialize<'de> for $name {
            fn deserialize<D: $crate::settings::serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                let json = <$crate::settings::Value as $crate::settings::serde::Deserialize>::deserialize(deserializer)?;
                <Self as $crate::settings::TypedSettings>::from_json(&json)
                    .map_err($crate::settings::serde::de::Error::custom)
            }
        }
    };
}

/// The second where there is one, else the first.
#[macro_export]
#[doc(hidden)]
macro_rules! __settings_or {
    ($first:expr) => {
        $first
    };
    ($first:expr, $second:expr) => {
        $second
    };
}

#[cfg(test)]
mod tests {
    use crate::settings::declare::write;
    use crate::settings::{AboveTo, OrZero, SettingsDecl, TypedSettings};
    use crate::{Error, Result};
    use serde_json::{Value, json};

    #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(rename_all = "snake_case")]
    enum Order {
        FromLeft,
        FromRight,
    }

    crate::settings! {
        /// Settings of nothing.
        struct Declared {
            /// How many,
            /// at least.
            ///
            /// More on it.
            pub count: u32 = 3, in OrZero(2..=10), unit "things";
            /// How likely.
            pub share: f32 = 0.95, in AboveTo(0.0, 1.0);
            /// From where.
            pub order: Order = Order::FromLeft;
        }
        unlisted {
            /// Seed.
            pub seed: u32 = 7, in 0..=8;
        }
        check Declared::fit;
    }

    impl Declared {
        fn fit(&self) -> Result<()> {
            let fit = self.count > 0 || self.share < 1.0;
            fit.then_some(())
                .ok_or_else(|| Error::setting("share", self.share, "needs a count"))
        }
    }

    #[test]
    fn one_declaration_gives_help_json_and_defaults() {
        let infos = Declared::infos();
        let texts: Vec<_> = infos
            .iter()
            .map(|i| (i.name, i.range.as_str(), i.unit, i.meaning.as_str()))
            .collect();
        assert_eq!(
            texts,
            [
                ("count", "0, or 2 … 10", "things", "How many, at least"),
                ("share", "above 0, at most 1", "", "How likely"),
                ("order", "from_left | from_right", "", "From where"),
            ]
        );
        // As typed: 0.95 as an f32 is no 0.95 of an f64.
        let defaults = json!({"count": 3, "share": 0.95, "order": "from_left"});
        assert_eq!(Declared::default().to_json(), defaults);
        assert_eq!(infos[2].names, ["from_left", "from_right"]);
        assert!(infos.iter().all(|info| info.default == defaults[info.name]));
        let decl = SettingsDecl::of::<Declared>();
        assert_eq!(
            (decl.names(), decl.defaults()),
            (vec!["count", "share", "order"], defaults)
        );
        let read = Declared::from_json(&json!({"order": "from_right", "count": 0})).unwrap();
        assert_eq!((read.count, read.order, read.seed), (0, Order::FromRight, 7));
        let text = serde_json::to_string(&read).unwrap();
        assert_eq!(serde_json::from_str::<Declared>(&text).unwrap(), read);
        assert_eq!(Declared::from_json(&Value::Null).unwrap(), Declared::default());
    }

    #[test]
    fn numbers_print_as_typed_and_read_back_to_the_bit() {
        for share in [0.95, 0.1, 1e-7, 0.333_333_34] {
            let written = Declared {
                share,
                ..Declared::default()
            };
            let text = written.to_json().to_string();
            let back = Declared::from_json(&serde_json::from_str(&text).unwrap()).unwrap();
            assert_eq!(back.share.to_bits(), share.to_bits(), "{text}");
        }
        for number in [3.4e38f32, 16_777_216.0, 0.0] {
            assert_eq!(
                serde_json::from_value::<f32>(write(&number)).unwrap().to_bits(),
                number.to_bits()
            );
        }
    }

    #[test]
    fn errors_name_setting_value_and_range() {
        for (json, words) in [
            (
                json!({"count": 1}),
                "setting count: 1 is out of range; it may be 0, or 2 … 10 (things)",
            ),
            (
                json!({"count": -4}),
                "setting count: -4 does not fit: invalid value: integer `-4`, expected u32; it may be 0, or 2 … 10 (things)",
            ),
            (
                json!({"share": 1.5}),
                "setting share: 1.5 is out of range; it may be above 0, at most 1",
            ),
            (json!({"order": "up"}), "it may be from_left | from_right"),
            (
                json!({"seed": 1}),
                "setting seed: 1 is for no setting of that name; there is: count, share, order",
            ),
            (json!({"count": 0, "share": 1.0}), "setting share: 1 needs a count"),
            (json!([]), "setting settings: array is not a JSON object"),
        ] {
            let text = Declared::from_json(&json).unwrap_err().to_string();
            assert!(text.contains(words), "{json}: {text}");
        }
        // Serde's words and the value, each once and shortened.
        let long = json!({"count": "x".repeat(1000)});
        assert!(Declared::from_json(&long).unwrap_err().to_string().len() < 300);
        let hidden = Declared {
            seed: 9,
            ..Declared::default()
        };
        assert_eq!(
            hidden.check().unwrap_err().to_string(),
            "setting seed: 9 is out of range; it may be 0 … 8"
        );
    }
}
