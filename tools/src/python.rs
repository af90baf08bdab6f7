//! Scripts in Python, in a process of their own, which a stop request ends.

use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::Duration;

use clerestory::{Error, Result};

use crate::experiments::watch::Watch;

/// How often a running Python is looked at.
const POLL: Duration = Duration::from_millis(20);

/// Runs `command` of the Python `python` and returns what it printed; `None` when `watch` says to stop before it ends, which ends it.
///
/// # Errors
/// [`Error::Setting`] when it cannot be run or fails, with the last line of its complaint and what it `needed`.
pub fn run(python: &Path, command: &mut Command, needed: &str, watch: &dyn Watch) -> Result<Option<String>> {
    let failed = |cause: String| Error::setting("python", python.display(), cause);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    // In the terminal's group Ctrl-C would reach it too, and its death would look like a failure.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(command, 0);
    let mut child = command
        .spawn()
        .map_err(|cause| failed(format!("cannot be run: {cause}")))?;
    // Read beside it: a full pipe would block it for ever.
    let printed = read_beside(child.stdout.take());
    let complaint = read_beside(child.stderr.take());
    let status = wait(&mut child, watch).map_err(|cause| failed(format!("cannot be waited for: {cause}")))?;
    let Some(status) = status else {
        return Ok(None);
    };
    let text = |reader: thread::JoinHandle<Vec<u8>>| {
        let bytes = reader.join().unwrap_or_default();
        String::from_utf8_lossy(&bytes).trim().to_owned()
    };
    if status.success() {
        return Ok(Some(text(printed)));
    }
    let text = text(complaint);
    let last = text.lines().last().unwrap_or("no message");
    Err(failed(format!("failed ({status}): {last}; it needs {needed}")))
}

/// Waits for the end; `None` when it was ended because `watch` says to stop.
fn wait(child: &mut Child, watch: &dyn Watch) -> std::io::Result<Option<ExitStatus>> {
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status));
        }
        if watch.stopped() {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(POLL);
    }
}

/// Reads to the end in a thread of its own; what was read before an error counts.
fn read_beside(pipe: Option<impl Read + Send + 'static>) -> thread::JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let _ = pipe.map(|mut pipe| pipe.read_to_end(&mut bytes));
        bytes
    })
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use crate::experiments::watch::Unwatched;

    #[test]
    fn a_stop_request_ends_the_child() {
        /// Asks to stop from the first question on.
        struct Stopping;
        impl Watch for Stopping {
            fn begin(&self, _what: &str, _done: usize, _all: usize) {}
            fn step(&self, _progress: clerestory::render::Progress) {}
            fn note(&self, _line: &str) {}
            fn stopped(&self) -> bool {
                true
            }
        }
        let shell = Path::new("sh");
        // The child would outlive every other test.
        let stopped = run(
            shell,
            Command::new(shell).args(["-c", "exec sleep 600"]),
            "sleep",
            &Stopping,
        );
        assert_eq!(stopped.unwrap(), None);
    }

    #[test]
    fn what_a_child_prints_and_how_it_fails_is_read() {
        let shell = Path::new("sh");
        let run = |script: &str| run(shell, Command::new(shell).args(["-c", script]), "a shell", &Unwatched);
        assert_eq!(run("echo 3.9.1").unwrap().as_deref(), Some("3.9.1"));
        // More than a pipe holds.
        let long = run("head -c 300000 /dev/zero | tr '\\0' x").unwrap();
        assert_eq!(long.map(|text| text.len()), Some(300_000));
        let failed = run("echo first >&2; echo last >&2; exit 3").unwrap_err().to_string();
        assert!(failed.contains("exit status: 3): last; it needs a shell"), "{failed}");
    }
}
