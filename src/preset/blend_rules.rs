//! By which rules a blend is made: what becomes of stems that not all sources have, what corresponds along two branches, and how
//! thick branches are.

use super::plan::{BlendScale, RadiusRule, StemRule};
use super::reader::Reader;
use super::schema::{Choice, Default, Field, Form, Kind, KindOf};

/// The field `stems` of a blend of two.
pub(super) const STEMS_FIELD: Field = Field {
    name: "stems",
    kind: Kind::Choice(&STEMS),
    default: Default::Is("Apart"),
    about: "what becomes of stems that only one of the two has",
};

/// The field `stems` of blends of any number.
pub(super) const STEMS_OF_MANY_FIELD: Field = Field {
    name: "stems",
    kind: Kind::Choice(&STEMS_OF_MANY),
    default: Default::Is("Apart"),
    about: "what becomes of stems that not all sources have",
};

/// The field `scale`.
pub(super) const SCALE_FIELD: Field = Field {
    name: "scale",
    kind: Kind::Choice(&SCALE),
    default: Default::Is("Chain"),
    about: "what is put in correspondence along two matched branches",
};

/// The field `radii`.
pub(super) const RADII_FIELD: Field = Field {
    name: "radii",
    kind: Kind::Choice(&RADII),
    default: Default::Is("Corrected"),
    about: "how thick branches are",
};

const APART: KindOf = KindOf {
    name: "Apart",
    form: Form::Plain,
    about: "a stem is there from half of its way on, and then at 0.7 of its growth or more: no bare poles",
};

const GROW: KindOf = KindOf {
    name: "Grow",
    form: Form::Plain,
    about: "they grow from the ground and wilt like all branches (Wang et al. 2017, 4.3); of one that has hardly begun a slim pole is there",
};

static STEMS: Choice = Choice {
    title: "Stems",
    kinds: &[
        APART,
        GROW,
        KindOf { name: "Merge", form: Form::Plain, about: "they split from the other's stems and merge with them" },
    ],
};

static STEMS_OF_MANY: Choice = Choice { title: "Stems of many", kinds: &[APART, GROW] };

static SCALE: Choice = Choice {
    title: "Scale",
    kinds: &[
        KindOf { name: "Chain", form: Form::Plain, about: "branches as a whole, by their length" },
        KindOf {
            name: "GrowthUnit",
            form: Form::Plain,
            about: "the stretches between matched side branches, each at a time of its own",
        },
    ],
};

static RADII: Choice = Choice {
    title: "Radii",
    kinds: &[
        KindOf {
            name: "Corrected",
            form: Form::Plain,
            about: "as thick as lies between the sources, scaled by the rule below where branches have not grown",
        },
        KindOf {
            name: "Ruled",
            form: Form::Plain,
            about: "from the tips to the roots by r^2.5 = Σ r^2.5 of what goes on (Wang et al. 2017, Eq. 3): even between forks, in all of \
                    the tree, and as thick as its tips make it, whatever its sources are",
        },
    ],
};

/// What is asked for.
pub(super) fn stems(fields: &Reader<'_, '_>) -> Option<StemRule> {
    let rule = |kind: &str| match kind {
        "Merge" => StemRule::Merge,
        "Grow" => StemRule::Grow,
        _ => StemRule::Apart,
    };
    fields.choice("stems", |kind, _| Some(rule(kind)))
}

/// What is asked for.
pub(super) fn scale(fields: &Reader<'_, '_>) -> Option<BlendScale> {
    fields
        .choice("scale", |kind, _| Some(if kind == "GrowthUnit" { BlendScale::GrowthUnit } else { BlendScale::Chain }))
}

/// What is asked for.
pub(super) fn radii(fields: &Reader<'_, '_>) -> Option<RadiusRule> {
    fields.choice("radii", |kind, _| Some(if kind == "Ruled" { RadiusRule::Ruled } else { RadiusRule::Corrected }))
}
