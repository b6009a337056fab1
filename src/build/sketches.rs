//! Sketches as a build draws them: SVGs read once, and every variant that follows one shaped after it is dressed.
//!
//! Trees are dressed before: twigs and leaves then follow the crown, and a sketched variant has the leaves that it has
//! without. A tree that can't be shaped, since it has no crown, stays as it is.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::pipeline::Inputs;
use crate::base::{Asked, Diagnostic, Key, Note};
use crate::plant::Plant;
use crate::preset::plan::{SketchDepth, SketchMethod, SketchParams, SketchScale};
use crate::preset::{Plan, data_asked_for};
use crate::sketch::{
    Drawing, LIKE_A_TRUNK, Method, Sketch, SketchError, SketchSize, SketchSteps, SketchViews, Sketched, Sketcher,
    ViewKind,
};

/// A sketch whose files are read.
#[derive(Clone, Debug)]
pub(super) struct Drawn {
    params: SketchParams,
    front: Drawing,
    side: Option<Drawing>,
    /// What is drawn over it.
    then: Vec<Drawn>,
    /// The content of its files.
    pub(super) key: Key,
}

/// Reads the sketches of a plan, in the order of [`Plan::drawn`].
///
/// # Errors
///
/// Those that can't be read, each at the field that names its file.
pub(super) fn sketches(plan: &Plan, inputs: &Inputs) -> Result<Vec<Drawn>, Vec<Diagnostic>> {
    let (mut drawn, mut errors) = (Vec::new(), Vec::new());
    for params in plan.drawn() {
        match Drawn::read(params, inputs) {
            Ok(read) => drawn.push(read),
            Err(found) => errors.extend(found),
        }
    }
    if errors.is_empty() { Ok(drawn) } else { Err(errors) }
}

/// What was closed, untangled or left out in sketches, once of a file, where it is named first.
pub(super) fn notes(drawn: &[Drawn]) -> Vec<Note> {
    let mut told: BTreeSet<(&str, String)> = BTreeSet::new();
    let mut notes = Vec::new();
    for Drawn { params, front, side, .. } in drawn.iter().flat_map(Drawn::each) {
        let front = told_of_front(front.notes.clone(), params.elevation == 0.0);
        let side = side.iter().flat_map(|side| side.notes.clone());
        let said = front.map(|message| (&params.crown, message)).chain(side.map(|message| (&params.side, message)));
        for (file, message) in said {
            if told.insert((file, message.clone())) {
                notes.push(Note::new(params.field.clone(), format!("its sketch {file}: {message}")));
            }
        }
    }
    notes
}

/// Only a level view can have a trunk: from above a slim part is a lobe, and the id would be an error.
fn told_of_front(notes: Vec<String>, level: bool) -> impl Iterator<Item = String> {
    notes.into_iter().filter(move |note| level || note != LIKE_A_TRUNK)
}

impl Drawn {
    /// Reads a sketch and those over it.
    ///
    /// # Errors
    ///
    /// Those of its files, at their fields.
    pub(super) fn read(params: &SketchParams, inputs: &Inputs) -> Result<Self, Vec<Diagnostic>> {
        let read = |file: &str, name: &str, closed: bool| {
            let wrong = |message: String, hint: &str| {
                let shown = inputs.get(file).map_or(file, |input| input.shown.as_str());
                let asked = Asked { file: String::new(), span: None, field: format!("{}.{name}", params.field) };
                data_asked_for(vec![Diagnostic::new(shown, format!("the sketch {message}")).with_hint(hint)], &asked)
            };
            let bytes = inputs.get(file).map_or(&[][..], |input| &input.bytes);
            let drawing = Drawing::read(bytes).map_err(|error| {
                let is_none = matches!(error, SketchError::Unreadable(_));
                let help = if is_none {
                    "save the drawing as plain SVG, in UTF-8"
                } else {
                    "draw the crown as filled shapes, or as a closed line"
                };
                wrong(error.to_string(), help)
            })?;
            if params.elevation != 0.0 && drawing.trunk.area() > 0.0 {
                let hint =
                    "leave `elevation` out, or the trunk: give a dot where it is seen to stand the id `foot` instead";
                return Err(wrong("has a trunk, which needs a level view".to_owned(), hint));
            }
            if closed && drawing.is_open() {
                let hint = "close it; only a crown seen from the front alone may be an open line";
                return Err(wrong("is an open line".to_owned(), hint));
            }
            Ok((drawing, Key::of_bytes(bytes)))
        };
        let several = !params.side.is_empty() || params.depth == SketchDepth::Revolved;
        let front = read(&params.crown, "crown", several);
        let side = (!params.side.is_empty()).then(|| read(&params.side, "side", true)).transpose();
        let (mut then, mut errors) = (Vec::new(), Vec::new());
        for over in &params.then {
            match Self::read(over, inputs) {
                Ok(read) => then.push(read),
                Err(found) => errors.extend(found),
            }
        }
        match (front, side) {
            (Ok((front, key)), Ok(side)) if errors.is_empty() => {
                let key = Key::stage("drawn", 1).input(key).input(side.as_ref().map_or(key, |s| s.1));
                let key = then.iter().fold(key, |key, over| key.input(over.key)).finish();
                Ok(Self { params: params.clone(), front, side: side.map(|s| s.0), then, key })
            }
            (front, side) => Err(front.err().into_iter().chain(side.err()).flatten().chain(errors).collect()),
        }
    }

    /// It, and what is drawn over it, in order.
    fn each(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.then)
    }

    /// The way of a plant to the sketch and on through those over it; none for one that can't be shaped.
    pub(super) fn sketched(&self, plant: &Plant) -> Option<SketchSteps> {
        let mut plant = Arc::new(plant.clone());
        let mut steps: Vec<Sketched> = Vec::new();
        for drawn in self.each() {
            if let Some(last) = steps.last() {
                plant = Arc::new(last.at(1.0));
            }
            // What has no crown any more stays as it is.
            steps.extend(drawn.one(plant.clone()));
        }
        SketchSteps::of(steps)
    }

    /// The way of a plant to the sketch alone.
    fn one(&self, plant: Arc<Plant>) -> Option<Sketched> {
        let kind = match self.params.depth {
            _ if self.side.is_some() => ViewKind::FrontAndSide,
            SketchDepth::Revolved if self.front.trunk.area() > 0.0 => ViewKind::RevolvedAboutFoot,
            SketchDepth::Revolved => ViewKind::Revolved,
            SketchDepth::Grown => ViewKind::Front,
            SketchDepth::Kept => ViewKind::FrontKept,
        };
        let SketchParams { view: azimuth, elevation, detail, .. } = self.params;
        let views = SketchViews { azimuth, elevation, kind, detail };
        let sketcher = Arc::new(Sketcher::bind(plant, views).ok()?);
        let size = match self.params.size {
            SketchScale::Crown => SketchSize::Crown,
            SketchScale::Stretched => SketchSize::Stretched,
            SketchScale::Metres(height) => SketchSize::Metres(height),
        };
        let method = match self.params.method {
            SketchMethod::Adaptive => Method::Adaptive,
            SketchMethod::Paper => Method::Paper,
            SketchMethod::Cages => Method::AdaptiveCages,
            SketchMethod::Baseline => Method::Baseline,
            SketchMethod::OneCage => Method::OneCage,
        };
        let rules = self.params.rules;
        let sketch = Sketch { front: &self.front, side: self.side.as_ref(), size, method, rules };
        sketcher.draw(&sketch).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_from_above_is_not_told_to_mark_a_trunk_which_it_could_not_have() {
        let cross = r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 100">
            <path d="M5 40H95V60H60V95H40V60H5Z"/></svg>"#;
        let notes = Drawing::read(cross.as_bytes()).unwrap().notes;
        assert_eq!(told_of_front(notes.clone(), true).count(), 1, "{notes:?}");
        assert_eq!(told_of_front(notes, false).count(), 0);
    }
}
