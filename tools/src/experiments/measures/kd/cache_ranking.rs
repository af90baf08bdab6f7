//! Whether caches have the source's ranking, by pairs of them.

use super::kd_caches::Row;
use super::published::Caches;
use crate::experiments::findings::{Bound, Criterion, Measured, rows};
use crate::experiments::measures::MEMORY_OF_ITS_OWN;

rows! {
    /// The caches of a scene, put in order.
    struct Order = "Pairs of caches in the source's order, leaves of 1" by [scene] {
        scene: String = "scene",
        bytes: f64 = "share of the pairs, by bytes",
        speed: Measured = "share of the pairs, by speed",
        on_hardware: bool = "on a device of its own",
    }
}

/// What is good of them.
pub const OF_ORDERS: &[Criterion<Order>] = &[
    Criterion::each(
        "the ranking by bytes is the source's: share of the pairs",
        Bound::AtLeast(0.9),
        |order: &Order| order.bytes.into(),
    )
    .because("at most one pair of 15 is turned in 1 of 120 orders by chance"),
    Criterion::each(
        "the ranking by speed is the source's: share of the pairs",
        Bound::AtLeast(0.9),
        |order: &Order| order.speed,
    )
    .among(|order| order.on_hardware)
    .needs(MEMORY_OF_ITS_OWN)
    .because("as by bytes"),
];

/// The share of pairs whose order is the source's, which come first; its ends are the pairs that intervals leave no doubt of, and those that they
/// leave possible.
fn share_in_order(forms: &[(f64, Measured)]) -> Measured {
    let (mut all, mut surely, mut found, mut possibly) = (0.0, 0.0, 0.0, 0.0);
    for (theirs, ours) in forms {
        for (_, above) in forms.iter().filter(|(above, _)| above > theirs) {
            let one = |is_so: bool| f64::from(u8::from(is_so));
            all += 1.0;
            surely += one(ours.high < above.low);
            found += one(ours.value < above.value);
            possibly += one(ours.low < above.high);
        }
    }
    Measured {
        value: found / all,
        low: surely / all,
        high: possibly / all,
    }
}

/// Orders of all scenes that have a counterpart.
pub fn orders(rows: &[Row]) -> Vec<Order> {
    let compared: Vec<&Row> = rows.iter().filter(|row| row.is_compared()).collect();
    let of = |row: &&Row, of: fn(&Caches) -> &[f64; 6], ours: Measured| Some((row.of_source(of)?, ours));
    let order = |scene: &[&Row]| {
        let bytes = scene
            .iter()
            .filter_map(|row| of(row, |caches| &caches.bytes, row.bytes.into()));
        let speed = scene
            .iter()
            .filter_map(|row| of(row, |caches| &caches.speed, (&row.speed).into()));
        Order {
            scene: scene[0].scene.clone(),
            bytes: share_in_order(&bytes.collect::<Vec<_>>()).value,
            speed: share_in_order(&speed.collect::<Vec<_>>()),
            on_hardware: scene[0].on_hardware,
        }
    };
    compared.chunk_by(|a, b| a.scene == b.scene).map(order).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_in_order_surely_or_possibly() {
        let of = |theirs, value, margin| (theirs, Measured::within(value, margin));
        let forms = [
            of(1.0, 1.0, 0.1),
            of(2.0, 2.0, 0.6),
            of(3.0, 2.5, 0.2),
            of(3.0, 0.5, 0.0),
        ];
        // Of five pairs two are in order with their whole intervals, one by its medians alone, and the last form is before all in ours.
        let share = share_in_order(&forms);
        assert_eq!([share.low, share.value, share.high], [0.4, 0.6, 0.6]);
    }
}
