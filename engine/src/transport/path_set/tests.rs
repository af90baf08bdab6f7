//! The grammar, its canonical text, and the algebra against a matcher that knows nothing of automata.

use proptest::prelude::*;

use super::*;

const DR: u32 = LOBE_DIFFUSE & LOBE_REFLECTION;
const GR: u32 = LOBE_GLOSSY & LOBE_REFLECTION;
const GT: u32 = LOBE_GLOSSY & LOBE_TRANSMISSION;
const SR: u32 = LOBE_SPECULAR & LOBE_REFLECTION;
const ST: u32 = LOBE_SPECULAR & LOBE_TRANSMISSION;

fn set(text: &str) -> PathSet {
    text.parse().unwrap_or_else(|error| panic!("{text}: {error}"))
}

#[test]
fn text_round_trips() {
    for (text, canonical) in [
        ("all", "all"),
        ("none", "none"),
        ("direct", "direct"),
        ("indirect", "indirect"),
        ("emitted, direct", "bounces=0..1"),
        ("direct,indirect", "bounces=1.."),
        ("bounces=1..3", "bounces=1..3"),
        ("bounces=..=3", "bounces=0..3"),
        ("bounces=2", "bounces=2"),
        ("bounces=1..1", "direct"),
        ("bounces=0..4094", "bounces=0..4094"),
        (
            "lobes=diffuse+specular",
            "all,lobes=diffuse+specular+reflection+transmission",
        ),
        (
            "lobes=reflection,direct",
            "direct,lobes=diffuse+glossy+specular+reflection",
        ),
        ("lobes=volume", "all,lobes=volume"),
        ("lobes=none", "emitted"),
        ("indirect,lobes=none", "none"),
        ("lobes=diffuse+glossy+specular+volume", "all"),
        // Expressions that say no more than the words do.
        ("LE", "emitted"),
        ("EL", "emitted"),
        ("L.*E", "all"),
        ("L.E", "direct"),
        ("L . {1,3} E", "bounces=1..3"),
        ("!L.*E", "none"),
        ("LDE,LSE", "none"),
        ("LDE", "direct,lobes=diffuse+reflection+transmission"),
        ("L[DGS]*E", "all,lobes=diffuse+glossy+specular+reflection+transmission"),
        ("LVE", "direct,lobes=volume"),
        // And those that say more.
        ("LS+DE", "LS+DE"),
        ("EDS+L", "LS+DE"),
        ("L S{1,} D E", "LS+DE"),
        ("LSD E|LSSDE", "LS{1,2}DE"),
        ("LS*DS*E", "LS*DS*E"),
        ("LSE|LDE", "direct,lobes=diffuse+specular+reflection+transmission"),
        ("L.*SE", "L.*SE"),
        ("!L.*S.*E", "all,lobes=diffuse+glossy+volume+reflection+transmission"),
        ("!L[^S]*E", "L.*S[^S]*E"),
        ("L[DrGt]{2,5}E", "L[DrGt]{2,5}E"),
        ("bounces=5..100,L[DrGt]*E", "bounces=5..100,L[DrGt]*E"),
        ("bounces=0..20,L.*SDE", "bounces=0..20,L.*SDE"),
        ("direct,L.*S.*E", "direct,lobes=specular+reflection+transmission"),
        ("L.rD.tE", "L.rD.tE"),
    ] {
        let parsed = set(text);
        assert_eq!(parsed.to_string(), canonical, "{text}");
        assert_eq!(set(canonical), parsed, "{text}");
        let json = serde_json::to_string(&parsed).unwrap();
        assert_eq!(serde_json::from_str::<PathSet>(&json).unwrap(), parsed);
    }
    assert_eq!(PathSet::default(), set("all"));
    assert_eq!(PathSet::DIRECT, set("direct"));
    assert_eq!(PathSet::INDIRECT, set("bounces=2.."));
    assert_eq!(PathSet::EMITTED, set("LE"));
    assert_eq!(PathSet::EMPTY, set("none"));
}

#[test]
fn errors_teach() {
    for (text, words) in [
        ("", &["emitted"][..]),
        ("dirct", &["indirect (2 and more)"]),
        ("bounces=3..1", &["empty"]),
        ("bounces=x", &["bounces=1..3"]),
        ("bounces=0..5000", &["4094"]),
        ("emitted,indirect", &["gap"]),
        ("lobes=shiny", &["glossy"]),
        ("lobes=diffuse,lobes=glossy", &["'+'"]),
        ("LXE", &["column 2", "'X' is not an event", "D diffuse"]),
        ("direct, LDXE", &["column 11", "'X'"]),
        ("LD", &["column 3", "lacks E"]),
        ("ED", &["column 3", "lacks L"]),
        ("D", &["column 1", "begins with L"]),
        ("LdE", &["column 2", "capital letters: D"]),
        ("L*E", &["column 2", "nothing before it"]),
        ("LD|SE", &["column 3", "L(D|S)E"]),
        ("L(DSE", &["column 2", "no ')'"]),
        ("LD)E", &["column 3", "no '('"]),
        ("L(D|)E", &["column 5", "'?'"]),
        ("L()E", &["column 3", "'?'"]),
        ("L[DE", &["column 4", "in brackets"]),
        ("L[D", &["column 2", "no ']'"]),
        ("L[]E", &["column 2", "no event"]),
        ("LVrE", &["column 2", "no sides"]),
        ("L(D)rE", &["column 5", "follows a class"]),
        ("LD{3,1}E", &["column 3", "not be greater"]),
        ("LD{x}E", &["column 4", "{1,3}"]),
        ("LD{2E", &["column 5", "{2,}"]),
        ("LD{65}E", &["column 4", "bounces=A..B"]),
        ("LDLE", &["column 3", "ends of a path"]),
        ("LDE SE", &["column 5", "end of a path"]),
        ("LDE!LSE", &["column 4", "'|' between paths"]),
        ("LDE|!LSE", &["column 5", "stands once"]),
        ("LD{20}SE", &["22 states", "15", "one by one"]),
        ("L((((D{64}){64}){64}){64})E", &["too large"]),
        ("L.*D.{30}S.{30}.*E", &["too large"]),
    ] {
        let message = text.parse::<PathSet>().unwrap_err().to_string();
        for word in words {
            assert!(message.contains(word), "{text}: {message}");
        }
    }
    assert!(PathSet::new(0, None, PATH_SET_LOBES + 1).is_err());
}

#[test]
fn packed_form_holds_everything() {
    let set = PathSet::new(3, Some(9), GT | LOBE_VOLUME).unwrap();
    let p = set.packed();
    assert_eq!(
        (p & PATH_SET_LOBES, (p >> 7) & 0xfff, p >> 19),
        (GT | LOBE_VOLUME, 3, 9)
    );
    assert_eq!(PathSet::ALL.packed() >> 19, PATH_SET_UNBOUNDED);
    assert!(!set.has_automaton() && !PathSet::ALL.has_automaton() && PathSet::EMPTY.has_automaton());
}

#[test]
fn words_belong_or_not() {
    let caustic = set("LS+DE");
    assert!(caustic.has_automaton() && !caustic.is_empty());
    for (word, belongs) in [
        (&[SR, DR][..], true),
        (&[ST, ST, DR], true),
        (&[DR, ST], false),
        (&[DR], false),
        (&[SR, GR], false),
        (&[], false),
        (&[SR, DR | GR], false),
        (&[SR, 0], false),
    ] {
        assert_eq!(caustic.contains(word), belongs, "{word:?}");
    }
    let bounded = set("bounces=3..20,LS*DS*E");
    assert!(bounded.has_automaton() && (bounded.min_bounces(), bounded.max_bounces()) == (3, Some(20)));
    assert!(bounded.contains(&[SR, DR, SR]) && !bounded.contains(&[SR, DR]));
    assert!(!bounded.contains(&[&[DR][..], &[SR; 20]].concat()) && bounded.contains(&[&[DR][..], &[SR; 19]].concat()));
}

#[test]
fn only_sets_that_need_it_tell_reflections_apart() {
    for (text, apart) in [
        ("all", false),
        ("LDE", false),
        ("LS+DE", false),
        ("L.*S.*E", false),
        ("L[DG]S*E", false),
        ("LD*G*E", true),
        ("LDG.E", false),
        ("L.*D.E|L.GE", true),
        ("LDGE|LGDE", true),
        ("L.*DE", false),
        ("L.*D.*E", true),
    ] {
        assert_eq!(set(text).tells_reflections_apart(), apart, "{text}");
    }
}

#[test]
fn the_algebra_holds() {
    let (caustics, specular) = (set("LS+DE"), set("L.*S.*E"));
    assert!(caustics.is_subset_of(&specular) && !specular.is_subset_of(&caustics));
    assert!(caustics.is_subset_of(&PathSet::INDIRECT) && PathSet::EMPTY.is_subset_of(&caustics));
    let rest = PathSet::ALL.without(&caustics).unwrap();
    assert_eq!(rest, set("!LS+DE"));
    assert_eq!(rest.intersection(&caustics).unwrap(), PathSet::EMPTY);
    assert_eq!(rest.union(&caustics).unwrap(), PathSet::ALL);
    assert_eq!(
        PathSet::ALL.without(&PathSet::DIRECT).unwrap().to_string(),
        "L(.{2,})?E"
    );
    assert_eq!(set("direct").union(&set("indirect")).unwrap(), set("bounces=1.."));
    // A range beside an automaton has several forms.
    let (a, b) = (set("bounces=0..40,LS*DE"), set("bounces=1..40,LS*DE"));
    assert!(a == b && a != set("bounces=1..41,LS*DE") && a.is_subset_of(&set("LS*DE")));
    assert_eq!(set("LS*DE").intersection(&set("bounces=0..40")).unwrap(), a);
}

#[test]
fn ranges_become_states_where_these_suffice() {
    for text in [
        "LV+E",
        "bounces=2..4,lobes=volume",
        "bounces=1..3,LS*DE",
        "none",
        "LS+DE",
    ] {
        let given = set(text);
        let by_states = given.by_states().unwrap();
        assert_eq!((by_states.min_bounces(), by_states.max_bounces()), (0, None), "{text}");
        assert!(
            by_states.is_subset_of(&given) && given.is_subset_of(&by_states),
            "{text}"
        );
    }
    assert_eq!(set("bounces=0..40,LS*DE").by_states(), None);
}

/// An expression of the test's own, matched by backtracking.
#[derive(Debug, Clone)]
enum Expression {
    Class(&'static str, u32),
    Sequence(Vec<Expression>),
    Choice(Vec<Expression>),
    Count(Box<Expression>, u32, Option<u32>),
}

impl Expression {
    fn text(&self) -> String {
        match self {
            Self::Class(text, _) => (*text).into(),
            Self::Sequence(parts) => format!("({})", parts.iter().map(Self::text).collect::<String>()),
            Self::Choice(parts) => {
                let parts: Vec<_> = parts.iter().map(Self::text).collect();
                format!("({})", parts.join("|"))
            }
            Self::Count(part, min, max) => {
                let max = max.map_or(String::new(), |m| m.to_string());
                format!("{}{{{min},{max}}}", part.text())
            }
        }
    }

    /// Where a match that begins at `at` may end.
    fn ends(&self, word: &[u32], at: usize) -> Vec<usize> {
        let mut ends = match self {
            Self::Class(_, lobes) => match word.get(at) {
                Some(event) if event & lobes != 0 => vec![at + 1],
                _ => Vec::new(),
            },
            Self::Sequence(parts) => parts.iter().fold(vec![at], |from, part| {
                from.iter().flat_map(|at| part.ends(word, *at)).collect()
            }),
            Self::Choice(parts) => parts.iter().flat_map(|part| part.ends(word, at)).collect(),
            Self::Count(part, min, max) => {
                let mut ends = Vec::new();
                let mut from = vec![at];
                // Matches of nothing need no more rounds than there are events.
                for round in 0..=max.unwrap_or(min + word.len() as u32 + 1) {
                    if round >= *min {
                        ends.extend(&from);
                    }
                    from = from.iter().flat_map(|at| part.ends(word, *at)).collect();
                    from.sort_unstable();
                    from.dedup();
                }
                ends
            }
        };
        ends.sort_unstable();
        ends.dedup();
        ends
    }
}

fn expressions() -> impl Strategy<Value = Expression> {
    let classes = prop::sample::select(vec![
        Expression::Class("D", LOBE_DIFFUSE),
        Expression::Class("G", LOBE_GLOSSY),
        Expression::Class("S", LOBE_SPECULAR),
        Expression::Class("V", LOBE_VOLUME),
        Expression::Class(".", PATH_SET_LOBES),
        Expression::Class("Gt", GT),
        Expression::Class("[^S]", PATH_SET_LOBES & !LOBE_SPECULAR),
        Expression::Class("[DrGr]", DR | GR),
        Expression::Class(".t", LOBE_TRANSMISSION),
    ]);
    classes.prop_recursive(3, 12, 3, |inner| {
        prop_oneof![
            prop::collection::vec(inner.clone(), 1..4).prop_map(Expression::Sequence),
            prop::collection::vec(inner.clone(), 1..4).prop_map(Expression::Choice),
            (inner, 0u32..3, prop::option::of(0u32..3))
                .prop_map(|(part, min, more)| { Expression::Count(Box::new(part), min, more.map(|m| min + m)) }),
        ]
    })
}

fn words() -> impl Strategy<Value = Vec<u32>> {
    prop::collection::vec((0u32..7).prop_map(|s| 1 << s), 0..7)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1024))]

    #[test]
    fn automata_accept_what_backtracking_accepts(
        expression in expressions(),
        words in prop::collection::vec(words(), 32),
        range in (0u32..4, prop::option::of(0u32..24)),
    ) {
        let belongs = |word: &[u32]| expression.ends(word, 0).contains(&word.len());
        let (min, max) = (range.0, range.1.map(|more| range.0 + more));
        let range = format!("bounces={min}..{}", max.map_or(String::new(), |m| m.to_string()));
        for (text, negated, ranged) in [
            (format!("L{}E", expression.text()), false, false),
            (format!("!L{}E", expression.text()), true, false),
            (format!("{range},L{}E", expression.text()), false, true),
        ] {
            let Ok(parsed) = text.parse::<PathSet>() else {
                let message = text.parse::<PathSet>().unwrap_err().to_string();
                prop_assert!(message.contains("automaton") || message.contains("reasonable"), "{}", message);
                continue;
            };
            for word in &words {
                let length = word.len() as u32;
                let within = !ranged || (length >= min && max.is_none_or(|m| length <= m));
                prop_assert_eq!(parsed.contains(word), (belongs(word) != negated) && within, "{} {:?}", text, word);
            }
            let canonical = parsed.to_string();
            prop_assert_eq!(canonical.parse::<PathSet>().map_err(|e| e.to_string()), Ok(parsed), "{}", canonical);
            let again = canonical.parse::<PathSet>().map(|set| set.to_string());
            prop_assert_eq!(again.map_err(|e| e.to_string()), Ok(canonical));
        }
    }

    #[test]
    fn operations_are_those_of_sets(a in expressions(), b in expressions(), words in prop::collection::vec(words(), 24)) {
        let parsed = |e: &Expression| format!("L{}E", e.text()).parse::<PathSet>();
        let (Ok(a), Ok(b)) = (parsed(&a), parsed(&b)) else { return Ok(()) };
        let (Ok(both), Ok(either), Ok(first)) = (a.intersection(&b), a.union(&b), a.without(&b)) else { return Ok(()) };
        for word in &words {
            let (x, y) = (a.contains(word), b.contains(word));
            prop_assert_eq!(both.contains(word), x && y);
            prop_assert_eq!(either.contains(word), x || y);
            prop_assert_eq!(first.contains(word), x && !y);
        }
        prop_assert!(both.is_subset_of(&a) && a.is_subset_of(&either) && first.is_subset_of(&a));
        prop_assert_eq!(a.is_subset_of(&b), first.is_empty());
        prop_assert_eq!(a == b, first.is_empty() && b.is_subset_of(&a));
        prop_assert_eq!(both.union(&first).ok(), Some(a));
    }
}
