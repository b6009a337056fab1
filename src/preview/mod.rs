//! `treewright preview`: a page on this machine that a designer keeps open while editing presets.
//!
//! A watcher ([`crate::watch`]) builds the sets; this serves what it built, tells the page what happens, makes trees
//! for it that are in no set yet (mixes, sketches, edits that are not saved), and writes what the designer decides back
//! into the presets' text.
//!
//! # The protocol
//!
//! | route | what |
//! |---|---|
//! | `GET /`, `/page/FILE` | the page: HTML, CSS and JS modules that are part of the program |
//! | `GET /three/FILE` | three.js out of the folder that was found; 404 without, and the page draws with pictures |
//! | `GET /api/state` | every set: variants, levels, scores, pins, errors with their lines (JSON) |
//! | `GET /api/events` | server-sent events: `state` whenever there is news, with what happened |
//! | `GET /set/SET/FILE` | a file that the set's manifest lists, nothing else |
//! | `GET /picture/SET/N?level=&turn=&width=&height=` | the Nth variant drawn by the rasterizer (PNG); `turn` in degrees |
//! | `GET /api/knobs?preset=&file=` | what sliders can set in a preset or species, with the schema's ranges (JSON) |
//! | `POST /api/draft` | a tree that is in no set: a variant or source with edits, a mix, a sketch; picture or mesh |
//! | `POST /api/save` | edits of a preset's or species' text, kept with its comments and order |
//! | `POST /api/decide` | a variant's number goes into `keep:` or `reject:` of its entry, or leaves it |
//! | `POST /api/sketch` | a drawn crown as SVG beside the preset |
//!
//! # Limits
//!
//! It listens to the loopback unless told otherwise; `gate.rs` tells which `Host` and `Origin` pass. A request has 10
//! seconds for its head and 10 for its body, at most 64 KiB and 1 MiB; an answer that nobody takes is given up after
//! 20 ([`PreviewOptions::patience`]). At most 64 connections at a time, of which 16 for events. Nothing is served but what stands above: names are
//! looked up, never joined to a path. Written are `*.ron` files that a preset reads and that lie in the project's
//! folder, and SVGs in its `sketches`; each whole or not at all, and only if it still is what the page saw.

mod desk;
pub mod drafts;
mod gate;
mod hub;
mod pages;
mod patience;
mod project;
mod routes;
mod scene;
mod server;
mod three;
mod turntable;

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::build::Progress;
use crate::watch::{Event, Next, WatchOptions, Watcher};
use hub::Hub;

/// What to show, and where.
#[derive(Clone, Debug)]
pub struct PreviewOptions {
    /// The folder of presets, the folder of sets, and how to build.
    pub watch: WatchOptions,
    /// Where to listen; port 0 takes any that is free.
    pub listen: SocketAddr,
    /// The folder of the package three.js; without it one is looked for in `node_modules` of the folder of presets, of
    /// the working folder and of those above them.
    pub three: Option<PathBuf>,
    /// How long a client may take for a request's head, again for its body, and twice as long to take an answer.
    pub patience: Duration,
}

impl PreviewOptions {
    /// Shows a folder of presets on a free port of the loopback, with sets in `out`.
    #[must_use]
    pub fn new(folder: impl Into<PathBuf>, out: impl Into<PathBuf>) -> Self {
        Self {
            watch: WatchOptions::new(folder, out),
            listen: SocketAddr::from(([127, 0, 0, 1], 0)),
            three: None,
            patience: Duration::from_secs(10),
        }
    }
}

/// A running preview. It ends when it is dropped.
#[derive(Debug)]
pub struct Preview {
    address: SocketAddr,
    serving: Option<JoinHandle<()>>,
    stop: Option<tokio::sync::oneshot::Sender<()>>,
    ends: Arc<AtomicBool>,
}

impl Preview {
    /// Starts to watch, build and serve; `tell` hears what the watcher does, from its thread.
    ///
    /// # Errors
    ///
    /// One sentence, when the address can't be listened at.
    pub fn start(options: PreviewOptions, tell: impl Fn(&Event<'_>) + Send + Sync + 'static) -> Result<Self, String> {
        let PreviewOptions { watch, listen, three, patience } = options;
        let three = three::found(three.as_deref(), &watch.folder)?;
        let mut watcher = Watcher::new(watch.clone());
        let hub = Arc::new(Hub::new(&watch, three, watcher.cache()));
        let (stop, stopped) = tokio::sync::oneshot::channel();
        let (address, serving) = server::start(listen, hub.clone(), patience, stopped)
            .map_err(|error| format!("can't listen at {listen}: {error}"))?;
        let ends = Arc::new(AtomicBool::new(false));
        let over = ends.clone();
        let (built, to_draw) = std::sync::mpsc::channel::<String>();
        let ahead = hub.clone();
        std::thread::spawn(move || {
            while let Ok(set) = to_draw.recv() {
                ahead.draw_ahead(&set);
            }
        });
        // It waits for the system most of the time and can't be woken: it ends with the process, or at the next event.
        std::thread::spawn(move || {
            watcher.run(&|event| {
                tell(&event);
                let set = match &event {
                    Event::Build(Progress::Set { outcome, .. }) => Some(outcome.set.clone()),
                    _ => None,
                };
                hub.take(event);
                let _ = set.map(|set| built.send(set));
                if over.load(Ordering::Relaxed) { Next::Stop } else { Next::Watch }
            });
        });
        Ok(Self { address, serving: Some(serving), stop: Some(stop), ends })
    }

    /// Where it listens.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Serves until the process ends.
    pub fn wait(mut self) {
        let _ = self.serving.take().map(JoinHandle::join);
    }
}

impl Drop for Preview {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        let _ = self.stop.take().map(|stop| stop.send(()));
    }
}
