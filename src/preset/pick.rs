//! `pick`, `candidates`, `scores` and `filter`: which trees of an entry are worth keeping. Lowered to a [`Selection`]
//! without its candidates, which the entry makes.

use super::plan::{FilterParams, Pick, ScoreParams};
use super::reader::{Reader, many};
use super::schema::{Choice, Default, Field, Form, Kind, KindOf, Record};
use super::variants::weights;

/// Most candidates of one entry.
const MOST_CANDIDATES: u64 = 2048;

/// The field `pick`.
pub(super) const PICK_FIELD: Field = Field {
    name: "pick",
    kind: Kind::Choice(&PICK),
    default: Default::Is("All"),
    about: "which of more trees are kept",
};

/// The field `candidates`.
pub(super) const CANDIDATES_FIELD: Field = Field {
    name: "candidates",
    kind: Kind::Integer { low: 1, high: MOST_CANDIDATES, unit: "trees" },
    default: Default::Else("2 × count², 8 to 2048"),
    about: "how many trees `pick` chooses from",
};

/// The field `scores`.
pub(super) const SCORES_FIELD: Field = Field {
    name: "scores",
    kind: Kind::Fields(&SCORES),
    default: Default::Is("()"),
    about: "what makes two trees differ, for `pick`",
};

/// The field `filter`.
pub(super) const FILTER_FIELD: Field = Field {
    name: "filter",
    kind: Kind::Choice(&FILTER),
    default: Default::Else("`Plausible`; where `pick` is `All` nothing is rejected"),
    about: "what is mended and rejected before trees are picked",
};

/// The field `filter` where no tree can be rejected, since none could take its place.
pub(super) const MENDED_FIELD: Field = Field {
    name: "filter",
    kind: Kind::Choice(&MENDED),
    default: Default::Is("Plausible()"),
    about: "whether branches that run into each other are removed",
};

static PICK: Choice = Choice {
    title: "Picks",
    kinds: &[
        KindOf { name: "All", form: Form::Plain, about: "the first ones that the filter lets through" },
        KindOf {
            name: "Inspiring",
            form: Form::Plain,
            about: "one of each kind of difference from the sources (Wang et al. 2017, 4.5)",
        },
        KindOf { name: "Diverse", form: Form::Fields(&DIVERSE), about: "those that differ most from each other" },
        KindOf { name: "Natural", form: Form::Plain, about: "those nearest to the sources" },
    ],
};

static DIVERSE: Record = Record {
    title: "Diverse",
    about: "Each tree is as far as can be from those picked before it.",
    fields: &[Field {
        name: "apart",
        kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
        default: Default::Is("0.0"),
        about: "least difference of two of them; where some don't reach it, a note tells how near they came; where no two do, an error",
    }],
};

const fn weight(name: &'static str, default: &'static str, about: &'static str) -> Field {
    Field { name, kind: Kind::Number { low: 0.0, high: 100.0, unit: "" }, default: Default::Is(default), about }
}

static SCORES: Record = Record {
    title: "Scores",
    about: "Weights against each other; only their ratios count.",
    fields: &[
        weight("crown", "0.4", "shape of the crown"),
        weight("ratio", "0.2", "share of the trunk that bears the crown"),
        weight("topology", "0.4", "which branch bears which"),
        Field {
            name: "sources",
            kind: Kind::Shares { what: "sources' names", low: 0.0, high: 1000.0, least: 1, most: 16 },
            default: Default::Else("the same for all"),
            about: "to differ from which source counts more, as `{\"oak\": 2}`; 1 for those left out",
        },
    ],
};

static FILTER: Choice = Choice {
    title: "Filters",
    kinds: &[
        KindOf { name: "None", form: Form::Plain, about: "trees stay as they are" },
        KindOf {
            name: "Plausible",
            form: Form::Fields(&PLAUSIBLE),
            about: "branches that run into each other are removed, trees unlike the sources' kind rejected",
        },
    ],
};

static PLAUSIBLE: Record = Record {
    title: "Plausible",
    about: "Sources stay as they are, and what runs into each other in a source may do so in its blends.",
    fields: &[
        COLLISIONS,
        RISE,
        Field {
            name: "botany",
            kind: Kind::Number { low: 0.0, high: 1000.0, unit: "" },
            default: Default::Is("2.0"),
            about: "how far proportions may lie beyond those of the sources; 1000 lets all through",
        },
    ],
};

const COLLISIONS: Field = Field {
    name: "collisions",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.01"),
    about: "share of a stem's surface that may lie inside another; 1 lets branches cross",
};

const RISE: Field = Field {
    name: "rise",
    kind: Kind::Number { low: 0.0, high: 1.0, unit: "" },
    default: Default::Is("0.01"),
    about: "how much more of it from order to order of the branches",
};

static MENDED: Choice = Choice {
    title: "Mended",
    kinds: &[
        KindOf { name: "None", form: Form::Plain, about: "trees stay as they are" },
        KindOf {
            name: "Plausible",
            form: Form::Fields(&CLEARED),
            about: "branches that run into each other are removed",
        },
    ],
};

static CLEARED: Record = Record {
    title: "Cleared",
    about: "What runs into each other in a source may do so in its blends.",
    fields: &[COLLISIONS, RISE],
};

/// Reads [`MENDED_FIELD`].
pub(super) fn mended(fields: &Reader<'_, '_>) -> Option<FilterParams> {
    fields
        .choice("filter", |kind, own| {
            let params = || FilterParams {
                collisions: own.number("collisions"),
                rise: own.number("rise"),
                ..FilterParams::CLEARED
            };
            Some((kind == "Plausible").then(params))
        })
        .flatten()
}

/// What the trees of an entry are cleared of whose every tree is kept: see [`wanted`].
pub(super) fn cleared(fields: &Reader<'_, '_>) -> Option<FilterParams> {
    (!fields.has("filter")).then_some(FilterParams::CLEARED)
}

/// What `pick` and its kin ask for.
pub(super) struct Wanted {
    pub(super) pick: Pick,
    pub(super) scores: ScoreParams,
    pub(super) filter: FilterParams,
    /// How many trees are made to choose from.
    pub(super) candidates: u64,
}

/// Reads the fields of an entry that gives `count` trees; none where all of them are kept as they are made.
pub(super) fn wanted(fields: &Reader<'_, '_>, count: u64, of: &[usize], names: &[&str]) -> Option<Wanted> {
    let pick = fields.choice("pick", |kind, own| {
        Some(match kind {
            "Inspiring" => Pick::Inspiring,
            "Diverse" => Pick::Diverse { apart: own.number("apart") },
            "Natural" => Pick::Natural,
            _ => Pick::All,
        })
    });
    let filter = if fields.has("filter") {
        fields.choice("filter", |kind, own| Some((kind == "Plausible").then(|| filter(own)))).flatten()
    } else {
        (pick != Some(Pick::All)).then_some(FilterParams { collisions: 0.01, rise: 0.01, botany: 2.0 })
    };
    let scores = fields.group("scores", |own| scores(own, of, names))?;
    let candidates = fields.integer_or("candidates", usual_candidates(count));
    if candidates < count {
        let message = format!("{} for the {count} trees of `count`", many(candidates, "candidate", "candidates"));
        fields.fault("candidates", message, "leave it out, or raise it");
    }
    let pick = pick?;
    if pick == Pick::All && fields.has("scores") {
        fields.fault("scores", "without `pick` nothing is scored", "give a `pick`, or leave it out");
    }
    if pick == Pick::All && filter.is_none() {
        if fields.has("candidates") {
            fields.fault(
                "candidates",
                "without `pick` or `filter` nothing is chosen",
                "give a `pick`, or leave it out",
            );
        }
        return None;
    }
    let filter = filter.unwrap_or(FilterParams { collisions: 1.0, rise: 0.0, ..FilterParams::CLEARED });
    Some(Wanted { pick, scores, filter, candidates: candidates.max(count) })
}

/// The paper's number of clusters of N trees, one of which is kept each: ⌈√(N/2)⌉ (2017 TVCG, 4.5).
pub(super) fn clusters(trees: u64) -> u64 {
    (trees as f64 / 2.0).sqrt().ceil().max(1.0) as u64
}

/// How many trees are made to keep `count` of them: the most for which the paper's number of clusters K = ⌈√(N/2)⌉ is
/// `count`, 2·count²; 8 at least, and at most 2048 and 65,536 comparisons of a kept one with all.
fn usual_candidates(count: u64) -> u64 {
    let count = count.max(1);
    (2 * count * count).clamp(8, MOST_CANDIDATES).min((65_536 / count).max(count))
}

fn filter(fields: &Reader<'_, '_>) -> FilterParams {
    FilterParams {
        collisions: fields.number("collisions"),
        rise: fields.number("rise"),
        botany: fields.number("botany"),
    }
}

fn scores(fields: &Reader<'_, '_>, of: &[usize], names: &[&str]) -> ScoreParams {
    let sources = weights(fields, "sources", "blend", of, names).unwrap_or_default();
    let (crown, ratio, topology) = (fields.number("crown"), fields.number("ratio"), fields.number("topology"));
    let sum = crown + ratio + topology;
    if sum < 1e-3 {
        fields.report().at(fields.span(), fields.path(), "all weights are zero", "give one of them");
        return ScoreParams { crown: 1.0, ratio: 0.0, topology: 0.0, sources };
    }
    ScoreParams { crown: crown / sum, ratio: ratio / sum, topology: topology / sum, sources }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn candidates_follow_the_papers_number_of_clusters_within_bounds() {
        for count in 2..=32 {
            assert_eq!(clusters(usual_candidates(count)), count);
        }
        assert_eq!([1, 33, 256].map(usual_candidates), [8, 1985, 256]);
    }
}
