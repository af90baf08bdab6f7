//! What follows from texels that maps need: which map needs the fewest, whatever the budget.

/// Maps whose need of texels differs by less than this factor are as good as each other.
pub const ALIKE: f64 = 1.1;

/// Names of those that at every budget need at most [`ALIKE`] times the texels of the best, from needs by budget.
pub fn best<'a>(all: &[(&'a str, Vec<f64>)]) -> Vec<&'a str> {
    let budgets = all.first().map_or(0, |(_, needs)| needs.len());
    let least = |budget: usize| all.iter().map(|(_, needs)| needs[budget]).fold(f64::INFINITY, f64::min);
    let least: Vec<f64> = (0..budgets).map(least).collect();
    let is_best = |needs: &[f64]| needs.iter().zip(&least).all(|(need, least)| *need <= ALIKE * least);
    let best = all.iter().filter(|(_, needs)| is_best(needs));
    best.map(|(name, _)| *name).collect()
}

/// What of needs is so at every budget: more than the cube's, fewer, or as many; `None` where budgets differ.
pub fn sign(needs: &[f64]) -> Option<std::cmp::Ordering> {
    let one = |need: &f64| match *need {
        need if need > ALIKE => std::cmp::Ordering::Greater,
        need if need < 1.0 / ALIKE => std::cmp::Ordering::Less,
        _ => std::cmp::Ordering::Equal,
    };
    let first = one(needs.first()?);
    needs.iter().all(|need| one(need) == first).then_some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn verdicts_are_those_of_every_budget() {
        use std::cmp::Ordering;
        assert_eq!(sign(&[1.2, 1.5, 1.11]), Some(Ordering::Greater));
        assert_eq!(sign(&[0.8, 0.5]), Some(Ordering::Less));
        assert_eq!(sign(&[1.0, 1.05, 0.95]), Some(Ordering::Equal));
        assert_eq!(sign(&[1.3, 0.8, 0.7]), None);
        assert_eq!(sign(&[]), None);
    }

    #[test]
    fn the_best_are_so_at_every_budget() {
        let needs = [("a", vec![1.0, 1.0]), ("b", vec![1.05, 0.95]), ("c", vec![0.99, 2.0])];
        assert_eq!(best(&needs), ["a", "b"]);
        assert_eq!(best(&[("a", vec![1.0, 2.0]), ("c", vec![2.0, 1.0])]), [""; 0]);
        assert_eq!(best(&[]), [""; 0]);
    }
}
