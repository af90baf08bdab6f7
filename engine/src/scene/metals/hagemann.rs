//! Complex indices of refraction by H.-J. Hagemann, W. Gudat and C. Kunz, J. Opt. Soc. Am. 65, 742 (1975) and DESY report SR-74/7 (1974): another
//! sample of four metals, with more loss in silver and gold. From the tables of refractiveindex.info (public domain by CC0), visible wavelengths.

use super::spectra::Spectrum;

/// Silver, gold, copper, aluminium.
pub const ALL: &[Spectrum] = &[
    Spectrum {
        name: "silver-hagemann",
        samples: &[
            [35420, 2110, 14200],
            [38150, 2290, 18600],
            [41330, 2260, 22800],
            [49590, 2370, 30900],
            [61990, 2690, 41800],
            [82660, 2710, 58000],
        ],
    },
    Spectrum {
        name: "gold-hagemann",
        samples: &[
            [37570, 19600, 18800],
            [39360, 19600, 18900],
            [41330, 19500, 18600],
            [44280, 18620, 18100],
            [47690, 15410, 17100],
            [51660, 8780, 20100],
            [56360, 6130, 26400],
            [61990, 4870, 33100],
            [82660, 4180, 51300],
        ],
    },
    Spectrum {
        name: "copper-hagemann",
        samples: &[
            [36470, 12700, 19500],
            [38750, 12320, 20700],
            [41330, 11840, 22100],
            [44280, 11690, 23600],
            [47690, 11520, 25000],
            [51660, 11210, 26000],
            [53910, 10370, 25900],
            [56360, 8260, 26000],
            [59040, 4680, 28100],
            [61990, 2720, 32400],
            [65250, 2140, 36700],
            [67020, 2150, 38600],
            [68880, 2130, 40500],
            [70850, 2140, 42400],
            [72930, 2230, 44300],
            [82660, 2600, 52600],
        ],
    },
    Spectrum {
        name: "aluminium-hagemann",
        samples: &[
            [31000, 2980, 37000],
            [41330, 5480, 50000],
            [49590, 7710, 59100],
            [61990, 12920, 72800],
            [68880, 17310, 79600],
            [72930, 20820, 83400],
            [77490, 25880, 85500],
            [82660, 28290, 77500],
        ],
    },
];
