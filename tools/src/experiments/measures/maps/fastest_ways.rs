//! Orders of ways to fill maps, by times of the same turns.

use clerestory::raster::{Layering, OctantCut};

use super::filled_maps::{Variant, Way, variants};
use crate::experiments::findings::{Measured, Repeats, rows};

rows! {
    /// Two ways that are expected to be neighbours in a scene, the faster one first.
    struct Order = "The document's order: neighbours by their times" by [scene, first, second] {
        scene: String = "scene",
        first: String = "expected to be faster",
        second: String = "than",
        ratio: Measured = "time of the first over that of the second",
        told_apart: String = "the order",
    }
}

/// The way of that name, without its size.
pub fn ways_of(name: &str) -> Option<Variant> {
    variants(1, super::map_rendering::LEVEL)
        .into_iter()
        .find(|variant| variant.name == name)
}

fn has_clip_distances(name: &str) -> bool {
    ways_of(name).is_some_and(|way| way.way == Way::Raster(Layering::Octants(OctantCut::ClipDistances)))
}

/// A way and its times.
type Timed<'a> = (&'a str, &'a Repeats);

/// The fastest of some ways.
fn fastest<'a>(ways: impl Iterator<Item = Timed<'a>>) -> Option<Timed<'a>> {
    ways.min_by(|a, b| a.1.measured().value.total_cmp(&b.1.measured().value))
}

impl Order {
    fn of(scene: &str, (first, time): Timed<'_>, (second, other): Timed<'_>) -> Self {
        let ratio = time.over(other).measured();
        Self {
            scene: scene.into(),
            first: first.into(),
            second: second.into(),
            ratio,
            told_apart: if ratio.high < 1.0 {
                "holds"
            } else if ratio.low > 1.0 {
                "is the reverse"
            } else {
                "is not told apart"
            }
            .into(),
        }
    }

    /// Whether one of both ways is by clip distances, of which the document has no figure.
    pub fn has_clip_distances(&self) -> bool {
        [&self.first, &self.second]
            .into_iter()
            .any(|name| has_clip_distances(name))
    }

    /// Neighbours in all scenes, from scenes, ways and times: by the document's figures, the fastest way of each; and clip distances between the two
    /// fastest of these.
    pub fn all(times: &[(&str, &str, &Repeats)]) -> Vec<Self> {
        let in_scene = |times: &[(&str, &str, &Repeats)]| {
            let Some((scene, ..)) = times.first() else {
                return Vec::new();
            };
            let ways = || times.iter().map(|(_, way, time)| (*way, *time));
            let figure = |way: &str| ways_of(way).and_then(|way| way.stated);
            let mut figures: Vec<f64> = ways().filter_map(|(way, _)| figure(way)).collect();
            figures.sort_by(|a, b| b.total_cmp(a));
            figures.dedup();
            let of = |stated: &f64| fastest(ways().filter(|(way, _)| figure(way) == Some(*stated)));
            let order: Vec<Timed<'_>> = figures.iter().filter_map(of).collect();
            let mut pairs: Vec<Self> = order.windows(2).map(|pair| Self::of(scene, pair[0], pair[1])).collect();
            let clip = fastest(ways().filter(|(way, _)| has_clip_distances(way)));
            if let (Some(clip), [first, second, ..]) = (clip, order.as_slice()) {
                pairs.extend([Self::of(scene, *first, clip), Self::of(scene, clip, *second)]);
            }
            pairs
        };
        times.chunk_by(|a, b| a.0 == b.0).flat_map(in_scene).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_hold_where_ratios_of_turns_lie_on_one_side() {
        let of = |from: f64| (0..9).map(|i| from + f64::from(i)).collect::<Repeats>();
        let told = |a: f64, b: f64| Order::of("scene", ("a", &of(a)), ("b", &of(b))).told_apart;
        assert_eq!(told(1.0, 6.0), "holds");
        assert_eq!(told(6.0, 1.0), "is the reverse");
        // A time over itself is 1 in every turn: on neither side.
        assert_eq!(told(1.0, 1.0), "is not told apart");
        // Too few turns tell nothing apart.
        let few = |from: f64| Repeats(vec![from; 4]);
        let order = Order::of("scene", ("a", &few(1.0)), ("b", &few(9.0)));
        assert_eq!(order.told_apart, "is not told apart");
    }

    #[test]
    fn neighbours_are_the_fastest_of_each_figure() {
        let (slow, fast, clip) = (Repeats(vec![3.0; 9]), Repeats(vec![1.0; 9]), Repeats(vec![2.0; 9]));
        let times = [
            ("s", "cube by passes", &slow),
            ("s", "cube by instances", &fast),
            ("s", "4d mask by instances, square", &slow),
            ("s", "4g clip distances, square", &clip),
        ];
        let all = Order::all(&times);
        let names: Vec<[&str; 2]> = all
            .iter()
            .map(|order| [order.first.as_str(), order.second.as_str()])
            .collect();
        let [cube, mask, clip] = [
            "cube by instances",
            "4d mask by instances, square",
            "4g clip distances, square",
        ];
        assert_eq!(names, [[cube, mask], [cube, clip], [clip, mask]]);
        assert!(all.iter().all(|order| order.ratio.high < 1.0) && !all[0].has_clip_distances());
    }
}
