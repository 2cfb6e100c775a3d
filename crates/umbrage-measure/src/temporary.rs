//! Temporary files and folders, which no process leaves behind for long.
//!
//! Each lies beside what it will become, under a name that begins with [`TEMPORARY`], and is locked
//! as long as its process lives. A process that is told to stop removes its own
//! ([`exit_without_traces`]). What a killed process left is known by its free lock, and the next
//! process that writes there removes it ([`remove_abandoned`]).

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Prefix of the names of unfinished files and folders.
pub const TEMPORARY: &str = ".umbrage-";

/// File in a temporary folder that is locked as long as its process lives.
const LOCK: &str = ".lock";

/// Folder in a temporary folder for what is about to be replaced.
const FORMER: &str = "former";

/// This process's temporary files and folders. Whoever makes, moves or removes any holds this lock.
static LIVE: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn live() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A temporary folder. Dropping it removes it with all its contents.
pub struct TemporaryFolder {
    path: PathBuf,
    /// The lock ends when the file is closed, however the process ends.
    _lock: File,
}

impl TemporaryFolder {
    /// Makes an empty folder in `parent`.
    ///
    /// # Errors
    /// The folder cannot be made there.
    pub fn new_in(parent: &Path) -> io::Result<Self> {
        let mut live = live();
        loop {
            let made = tempfile::Builder::new().prefix(TEMPORARY).tempdir_in(parent)?;
            // Until its lock is held, the folder looks like one that a killed process left.
            let lock = File::create(made.path().join(LOCK)).and_then(|file| {
                lock(&file)?;
                Ok(file)
            });
            match lock {
                Ok(lock) if made.path().exists() => {
                    let path = made.keep();
                    live.insert(path.clone());
                    return Ok(Self { path, _lock: lock });
                }
                Err(e) if e.kind() != ErrorKind::NotFound => return Err(e),
                _ => {}
            }
        }
    }

    /// The folder's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Moves `new`, which lies in this folder, to `target`. What was there is replaced; if that
    /// fails, it is kept.
    ///
    /// # Errors
    /// Something cannot be moved.
    pub fn put(&self, new: &Path, target: &Path) -> io::Result<()> {
        // The two moves belong together: between them a signal would find no report anywhere.
        let _undisturbed = live();
        let name = target.file_name().ok_or(ErrorKind::InvalidInput)?;
        let former = self.path.join(FORMER).join(name);
        let has_former = target.exists();
        if has_former {
            std::fs::create_dir(self.path.join(FORMER))?;
            std::fs::rename(target, &former)?;
        }
        std::fs::rename(new, target).inspect_err(|_| {
            if has_former {
                // The former contents are better than none. If this fails too, the first error is
                // returned.
                let _ = std::fs::rename(&former, target);
            }
        })
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        let mut live = live();
        live.remove(&self.path);
        // A temporary folder that cannot be removed is no reason to fail.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

/// Writes a file that is never seen incomplete: `write` fills a temporary file in the same folder,
/// which is then renamed.
pub(crate) fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut File) -> io::Result<()>,
) -> io::Result<()> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    // Temporary files can only be read by their owner; this one gets the permissions of ordinary
    // files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = {
        let mut live = live();
        loop {
            let file = builder.tempfile_in(folder)?;
            lock(file.as_file())?;
            // Until its lock was held, it looked like one that a killed process left.
            if file.path().exists() {
                live.insert(file.path().to_owned());
                break file;
            }
        }
    };
    let written = write(file.as_file_mut());
    let mut live = live();
    live.remove(file.path());
    written?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Removes the temporary files and folders in `folder` whose processes have ended. What such a
/// process was about to replace is put back. Whatever cannot be removed stays.
pub fn remove_abandoned(folder: &Path) {
    let _undisturbed = live();
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(TEMPORARY) {
            // It may have vanished meanwhile, or not be ours to remove.
            let _ = remove_if_abandoned(&entry.path(), folder);
        }
    }
}

fn remove_if_abandoned(path: &Path, folder: &Path) -> io::Result<()> {
    if !path.is_dir() {
        // Where there are no locks, nobody knows whether its process lives.
        return match File::open(path)?.try_lock() {
            Ok(()) => std::fs::remove_file(path),
            Err(_) => Ok(()),
        };
    }
    let lock = File::options().create(true).truncate(false).write(true).open(path.join(LOCK))?;
    if lock.try_lock().is_err() {
        return Ok(());
    }
    if let Ok(former) = std::fs::read_dir(path.join(FORMER)) {
        for former in former.flatten() {
            let target = folder.join(former.file_name());
            if !target.exists() {
                std::fs::rename(former.path(), target)?;
            }
        }
    }
    std::fs::remove_dir_all(path)
}

/// Ends the process at once, with this exit code, after removing its temporary files and folders.
/// This is for processes that are told to stop while they work.
pub fn exit_without_traces(code: i32) -> ! {
    // The lock is kept to the end, so no other thread makes new ones.
    let live = live();
    for path in live.iter() {
        let _ =
            if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
    std::process::exit(code)
}

/// Locks a file. Some network file systems have no locks, and do without.
fn lock(file: &File) -> io::Result<()> {
    match file.lock() {
        Err(e) if e.kind() != ErrorKind::Unsupported => Err(e),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().file_name());
        let mut names: Vec<String> = names.map(|n| n.into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// What killed processes leave looks like this: nobody holds the locks.
    #[test]
    fn abandoned_work_is_removed_and_other_work_is_not() {
        let home = tempfile::tempdir().unwrap();
        let home = home.path();
        let at_work = TemporaryFolder::new_in(home).unwrap();
        std::fs::write(home.join(".umbrage-file"), b"half").unwrap();
        std::fs::write(home.join("picture.png"), b"whole").unwrap();
        for folder in [".umbrage-bare", ".umbrage-locked"] {
            std::fs::create_dir_all(home.join(folder).join("new")).unwrap();
        }
        std::fs::write(home.join(".umbrage-locked").join(LOCK), b"").unwrap();
        remove_abandoned(home);
        let staying = at_work.path().file_name().unwrap().to_str().unwrap();
        assert_eq!(names(home), [staying, "picture.png"]);
        drop(at_work);
        assert_eq!(names(home), ["picture.png"]);
    }

    #[test]
    fn what_was_about_to_be_replaced_comes_back() {
        let home = tempfile::tempdir().unwrap();
        let home = home.path();
        let former = home.join(".umbrage-killed").join(FORMER);
        for (name, content) in [("report", b"old"), ("other", b"old")] {
            std::fs::create_dir_all(former.join(name)).unwrap();
            std::fs::write(former.join(name).join("index.html"), content).unwrap();
        }
        std::fs::create_dir(home.join("other")).unwrap();
        remove_abandoned(home);
        assert_eq!(names(home), ["other", "report"]);
        assert_eq!(names(&home.join("report")), ["index.html"]);
        assert!(names(&home.join("other")).is_empty(), "newer contents stay");
    }

    #[test]
    fn folders_take_the_place_of_former_ones() {
        let home = tempfile::tempdir().unwrap();
        let target = home.path().join("report");
        for content in ["first", "second"] {
            let folder = TemporaryFolder::new_in(home.path()).unwrap();
            let new = folder.path().join("new");
            std::fs::create_dir(&new).unwrap();
            std::fs::write(new.join("index.html"), content).unwrap();
            folder.put(&new, &target).unwrap();
            assert!(folder.put(&new, &target).is_err(), "nothing is left to move");
            assert_eq!(std::fs::read_to_string(target.join("index.html")).unwrap(), content);
        }
        assert_eq!(names(home.path()), ["report"]);
    }
}
