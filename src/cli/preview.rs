//! `treewright preview`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use super::args::PreviewArguments;
use super::report::{Failure, Meter};
use super::watch::tell;
use crate::preview::{Preview, PreviewOptions};
use crate::watch::WatchOptions;

/// Serves until the process is interrupted.
pub(super) fn run(arguments: &PreviewArguments) -> Result<(), Failure> {
    if !arguments.folder.is_dir() {
        return Err(Failure::Other(format!("{} is not a folder", arguments.folder.display())));
    }
    let named = || std::env::var_os("TREEWRIGHT_THREE").filter(|name| !name.is_empty()).map(PathBuf::from);
    let options = PreviewOptions {
        watch: WatchOptions {
            cache: arguments.cache.options(),
            limits: arguments.limits.limits(),
            poll: arguments.poll.map(|every| Duration::from_millis(every.into())),
            ..WatchOptions::new(&arguments.folder, &arguments.out)
        },
        listen: SocketAddr::new(arguments.listen, arguments.port),
        three: arguments.three.clone().or_else(named),
        ..PreviewOptions::new(&arguments.folder, &arguments.out)
    };
    let meter = Meter::plain();
    let told = Meter::plain();
    let preview = Preview::start(options, move |event| tell(&told, event)).map_err(Failure::Other)?;
    meter.line(&format!("open http://{}/", preview.address()));
    preview.wait();
    Ok(())
}
