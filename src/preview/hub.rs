//! What the watcher, the routes and the listeners share: the project as it is known, what was drawn of it, and who
//! wants to hear of changes.

use std::collections::VecDeque;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use axum::body::{Bytes, HttpBody};
use hyper::body::Frame;
use tokio::sync::mpsc;

use super::drafts::Workshop;
use super::project::Project;
use super::scene::{self, Wear};
use super::three::Three;
use super::turntable::{self, Framing};
use crate::build::{Cache, Limits};
use crate::export::Manifest;
use crate::mesh::TreeMesh;
use crate::watch::{Event, WatchOptions};

/// Most who listen for events.
const MOST_LISTENERS: usize = 16;
/// Events that a listener may be behind before it is dropped; it comes again by itself and asks for the whole state.
const BEHIND: usize = 256;
/// Most bytes of pictures that are kept.
const MOST_DRAWN: usize = 192 << 20;
/// Most pictures of a set that are drawn before they are asked for.
const MOST_AHEAD: usize = 500;
/// Most meshes and sets' textures that are kept.
const MOST_READ: (usize, usize) = (8, 3);

/// See the head of this file.
pub(super) struct Hub {
    project: Mutex<Project>,
    pub(super) listeners: Listeners,
    pub(super) three: Option<Three>,
    pub(super) workshop: Workshop,
    pub(super) limits: Limits,
    drawn: Mutex<Kept<Vec<u8>>>,
    wears: Mutex<Kept<Wear>>,
    /// Held while a set's textures are read: who asks meanwhile waits for them and does not read them as well.
    reading: Mutex<()>,
    meshes: Mutex<Kept<TreeMesh>>,
}

/// Which picture of a variant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shot {
    /// Which level; none for the coarsest that looks right at the size.
    pub(super) level: Option<usize>,
    /// Degrees.
    pub(super) turn: i32,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Shot {
    /// As the gallery asks for it (`picture` in `page/kit.js`).
    const GALLERY: Self = Self { level: None, turn: 26, width: 300, height: 360 };
}

impl Hub {
    pub(super) fn new(watch: &WatchOptions, three: Option<Three>, cache: Arc<Cache>) -> Self {
        let version = three.as_ref().map(|three| three.version.clone());
        Self {
            project: Mutex::new(Project::new(&watch.folder, &watch.out, version)),
            listeners: Listeners::default(),
            three,
            workshop: Workshop::new(cache, watch.limits.clone()),
            limits: watch.limits.clone(),
            drawn: Mutex::default(),
            wears: Mutex::default(),
            reading: Mutex::default(),
            meshes: Mutex::default(),
        }
    }

    /// The project as it is known.
    pub(super) fn project(&self) -> MutexGuard<'_, Project> {
        self.project.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes what the watcher tells, and tells the page.
    pub(super) fn take(&self, event: Event<'_>) {
        if matches!(event, Event::Preset(_)) {
            self.workshop.saved();
        }
        let news = self.project().take(event);
        if let Some(news) = news {
            self.listeners.tell("state", &news);
        }
    }

    /// Draws the small pictures of a set ahead, so that a gallery that is opened finds them; ends early when the set is
    /// built anew.
    pub(super) fn draw_ahead(&self, set: &str) {
        let Some((manifest, _)) = self.project().set(set) else { return };
        for index in 0..manifest.variants.len().min(MOST_AHEAD) {
            let same = self.project().set(set).is_some_and(|(now, _)| now.key == manifest.key);
            if !same || self.picture(set, index, Shot::GALLERY).is_none() {
                return;
            }
        }
    }

    /// A picture of a variant, as PNG; none for what is not there.
    pub(super) fn picture(&self, set: &str, index: usize, shot: Shot) -> Option<Arc<Vec<u8>>> {
        let (manifest, folder) = self.project().set(set)?;
        let variant = manifest.variants.get(index)?;
        let level = shot.level.unwrap_or_else(|| level_for(&manifest, index, shot.height));
        let mesh = &variant.levels.get(level)?.mesh;
        let key = &manifest.key;
        let name = format!("{key} {mesh} {} {} {}", shot.turn, shot.width, shot.height);
        // Of its own, so that the lock is not held while it is drawn.
        let known = self.drawn.lock().unwrap_or_else(PoisonError::into_inner).get(&name);
        if known.is_some() {
            return known;
        }
        let read = |file: &str| std::fs::read(folder.join(file)).ok();
        let turn = self.reading.lock().unwrap_or_else(PoisonError::into_inner);
        let wear = kept(
            &self.wears,
            key,
            MOST_READ.1,
            |_| 1,
            || {
                // What the set has and can't be read is not kept as if it were blank: a build may be under way.
                let map = |material: &str, map: &str| {
                    let entry = manifest.textures.iter().find(|t| t.material == material && t.map == map);
                    entry.map_or_else(|| Some(Vec::new()), |t| read(&t.file))
                };
                let leaf = [map("leaf", "color")?, map("leaf", "normal")?];
                let bark = [map("bark", "color")?, map("bark", "normal")?];
                Some(Wear::of_png([&leaf[0], &leaf[1]], [&bark[0], &bark[1]]))
            },
        )?;
        drop(turn);
        let tree = kept(
            &self.meshes,
            &format!("{key} {mesh}"),
            MOST_READ.0,
            |_| 1,
            || {
                let others = variant.assets.iter().flat_map(|asset| &asset.files);
                std::iter::once(&variant.file)
                    .chain(others)
                    .filter(|file| file.ends_with(".glb") && manifest.files.iter().any(|f| f.file == **file))
                    .find_map(|file| scene::level(&read(file)?, mesh))
            },
        )?;
        let (reach, top, foot) = extent(&manifest);
        let azimuth = (shot.turn as f32).to_radians();
        let framing = Framing { reach, top, foot, ..Framing::around(&tree, azimuth, 0.0, shot.width, shot.height) };
        let png = turntable::png(&turntable::draw(&tree, &wear, &framing, if shot.height > 500 { 2 } else { 3 }));
        kept(&self.drawn, &name, MOST_DRAWN, Vec::len, || Some(png))
    }
}

/// The coarsest level that is as good as the full one at a size in pixels; impostors need a shader to be looked at.
fn level_for(manifest: &Manifest, index: usize, pixels: u32) -> usize {
    let coverage = pixels as f32 / 1080.0;
    let levels = &manifest.variants[index].levels;
    let usable = levels.iter().take_while(|l| matches!(l.kind.as_str(), "Full" | "Thinned" | "BillboardCloud")).count();
    let wanted = levels.iter().position(|level| coverage >= level.screen_coverage).unwrap_or(levels.len());
    wanted.min(usable.saturating_sub(1))
}

/// What must be seen so that all variants of a set are shown at one scale: reach to the sides, top and foot.
fn extent(manifest: &Manifest) -> (f32, f32, f32) {
    manifest.variants.iter().map(|v| v.bounds).fold((0.1, 0.1, 0.0), |(reach, top, foot), b| {
        let far = [b.min[0], b.max[0], b.min[2], b.max[2]].into_iter().fold(reach, |far: f32, x| far.max(x.abs()));
        (far, b.max[1].max(top), b.min[1].min(foot))
    })
}

/// What was made, by name, what was used longest ago in front.
struct Kept<T> {
    made: VecDeque<(String, Arc<T>)>,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { made: VecDeque::new() }
    }
}

impl<T> Kept<T> {
    fn get(&mut self, name: &str) -> Option<Arc<T>> {
        let at = self.made.iter().rposition(|(known, _)| known == name)?;
        let found = self.made.remove(at)?;
        let value = found.1.clone();
        self.made.push_back(found);
        Some(value)
    }
}

/// What is kept under a name, or made now; what was used longest ago goes beyond `most` in all.
fn kept<T>(
    all: &Mutex<Kept<T>>,
    name: &str,
    most: usize,
    weight: impl Fn(&T) -> usize,
    make: impl FnOnce() -> Option<T>,
) -> Option<Arc<T>> {
    let lock = || all.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(found) = lock().get(name) {
        return Some(found);
    }
    let made = Arc::new(make()?);
    let mut all = lock();
    // Somebody may have made it meanwhile.
    if let Some(found) = all.get(name) {
        return Some(found);
    }
    all.made.push_back((name.to_owned(), made.clone()));
    let mut sum: usize = all.made.iter().map(|(_, value)| weight(value)).sum();
    while sum > most && all.made.len() > 1 {
        if let Some((_, old)) = all.made.pop_front() {
            sum -= weight(&old);
        }
    }
    Some(made)
}

/// Who hears of changes.
#[derive(Default)]
pub(super) struct Listeners {
    all: Mutex<Vec<mpsc::Sender<Bytes>>>,
}

impl Listeners {
    /// One more; none when there are too many.
    pub(super) fn join(&self) -> Option<Heard> {
        let mut all = self.all.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|listener| !listener.is_closed());
        if all.len() >= MOST_LISTENERS {
            return None;
        }
        let (sender, receiver) = mpsc::channel(BEHIND);
        // Says at once that it is open.
        let _ = sender.try_send(Bytes::from_static(b"retry: 500\n\n"));
        all.push(sender);
        Some(Heard { receiver })
    }

    /// Tells everybody; the text of an event is one line.
    pub(super) fn tell(&self, event: &str, line: &serde_json::Value) {
        self.send(Bytes::from(format!("event: {event}\ndata: {line}\n\n")));
    }

    /// Keeps connections alive, and finds those that are not.
    pub(super) fn pulse(&self) {
        self.send(Bytes::from_static(b":\n\n"));
    }

    fn send(&self, bytes: Bytes) {
        self.all
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .retain(|listener| listener.try_send(bytes.clone()).is_ok());
    }
}

/// What one listener hears, as the body of an answer.
pub(super) struct Heard {
    receiver: mpsc::Receiver<Bytes>,
}

impl HttpBody for Heard {
    type Data = Bytes;
    type Error = std::convert::Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Self::Error>>> {
        self.receiver.poll_recv(context).map(|bytes| bytes.map(|bytes| Ok(Frame::data(bytes))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_used_longest_ago_goes_first() {
        let all: Mutex<Kept<Vec<u8>>> = Mutex::default();
        let keep = |name: &str, bytes: usize| kept(&all, name, 100, Vec::len, || Some(vec![0; bytes])).unwrap().len();
        assert_eq!([keep("a", 40), keep("b", 40)], [40, 40]);
        assert_eq!(keep("a", 1), 40, "it is kept");
        keep("c", 40);
        let names: Vec<String> = all.lock().unwrap().made.iter().map(|m| m.0.clone()).collect();
        assert_eq!(names, ["a", "c"]);
        assert_eq!(keep("large", 1000), 1000);
        assert!(kept(&all, "none", 100, Vec::len, || None).is_none());
    }

    #[test]
    fn who_does_not_listen_is_dropped() {
        let listeners = Listeners::default();
        let heard: Vec<Heard> = std::iter::from_fn(|| listeners.join()).collect();
        assert_eq!(heard.len(), MOST_LISTENERS);
        for _ in 0..BEHIND {
            listeners.pulse();
        }
        assert!(listeners.all.lock().unwrap().is_empty());
        drop(heard);
        assert!(listeners.join().is_some());
    }
}
