//! An Indexed Job for Kubernetes: workers that share a volume. No task is named, each takes what is ready.

use std::path::{Component, Path, PathBuf};

use super::glue::{Glue, literal, shell_word};
use crate::failure::Failure;

/// Tiles for each worker: with ten, workers are busy most of the time.
const TILES_PER_WORKER: u32 = 10;
/// Letters of a name at most; the names of pods are longer by their index.
const NAME_MAX: usize = 40;
/// Exit code of a job that cannot be built: trying again does not help.
const FAILED: u8 = 2;

/// The manifest.
///
/// # Errors
/// When job, sources and database have no folder in common at which a volume could be mounted.
pub fn kubernetes(glue: &Glue) -> Result<String, Failure> {
    let (rows, columns) = glue.tiles;
    let workers = (rows * columns).div_ceil(TILES_PER_WORKER);
    let name = name_of(&glue.area);
    let (job, out) = (shell_word(&glue.job), shell_word(&glue.out));
    // Breaches are a result: publishing with some of them is a success.
    let command = format!("tiefort worker {job} --out {out} --workers 1 --quiet || [ $? -eq 1 ]");
    let command = literal(Path::new(&command));
    let (folder, memory) = (literal(&common_folder(glue)?), glue.task_mebibytes());
    Ok(format!(
        r#"# Gaming area {area} in {rows} x {columns} tiles, for Kubernetes 1.29 or newer: `kubectl apply -f THIS_FILE`.
# Workers share a volume and take what is ready; any of them may be killed and is started again.
# To be put in: an image with `tiefort` and `sh`, and a ReadWriteMany claim whose root is mounted as the folder below.
apiVersion: batch/v1
kind: Job
metadata:
  name: {name}
  labels:
    app.kubernetes.io/name: tiefort
spec:
  completionMode: Indexed
  completions: {workers}
  parallelism: {workers}
  backoffLimitPerIndex: 6
  podFailurePolicy:
    rules:
      - action: FailJob
        onExitCodes:
          containerName: worker
          operator: In
          values: [{FAILED}]
  template:
    metadata:
      labels:
        app.kubernetes.io/name: tiefort
    spec:
      restartPolicy: Never
      containers:
        - name: worker
          image: tiefort
          command: ["/bin/sh", "-c", {command}]
          resources:
            requests:
              cpu: "1"
              memory: {memory}Mi
            limits:
              memory: {memory}Mi
          volumeMounts:
            - name: terrain
              mountPath: {folder}
      volumes:
        - name: terrain
          persistentVolumeClaim:
            claimName: terrain
"#,
        area = glue.area,
    ))
}

/// The innermost folder in which job, sources and database lie.
fn common_folder(glue: &Glue) -> Result<PathBuf, Failure> {
    let plain = |path: &PathBuf| without_steps_up(path);
    let job = plain(&glue.job);
    let mut folder = job.parent().unwrap_or(Path::new("/"));
    for path in glue.sources.iter().chain([&glue.out]).map(plain) {
        folder = folder.ancestors().find(|folder| path.starts_with(folder)).unwrap_or(Path::new("/"));
    }
    if folder.parent().is_none() {
        let message = format!(
            "{}: found a job, sources and a database without a folder in common, expected one for the volume",
            glue.job.display()
        );
        return Err(Failure::new(message, "put the job and its sources beside the folder that --out names"));
    }
    Ok(folder.to_path_buf())
}

/// The same place without `..`: `/jobs/../dem` lies in `/dem`, not in `/jobs`.
fn without_steps_up(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut place, part| {
        if part == Component::ParentDir {
            place.pop();
        } else {
            place.push(part);
        }
        place
    })
}

/// An area's name as Kubernetes has names: small letters, digits and hyphens.
fn name_of(area: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '-' };
    let name: String = area.chars().map(plain).take(NAME_MAX).collect();
    format!("tiefort-{}", name.trim_matches('-')).trim_end_matches('-').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glue(job: &str, sources: &[&str], out: &str) -> Glue {
        Glue {
            area: "Fort_Irwin 2".into(),
            program: "tiefort".into(),
            job: job.into(),
            out: out.into(),
            sources: sources.iter().map(PathBuf::from).collect(),
            tasks: Vec::new(),
            tiles: (6, 6),
            task_bytes: 100 << 20,
        }
    }

    #[test]
    fn the_volume_is_mounted_where_all_files_lie() {
        let all = glue("/share/jobs/a.toml", &["/share/dem/1.tif"], "/share/a.tdb");
        assert_eq!(common_folder(&all).unwrap(), Path::new("/share"));
        assert_eq!(common_folder(&glue("/share/a.toml", &[], "/share/a.tdb")).unwrap(), Path::new("/share"));
        let beside = glue("/share/jobs/a.toml", &["/share/jobs/../dem/1.tif"], "/share/jobs/a.tdb");
        assert_eq!(common_folder(&beside).unwrap(), Path::new("/share"));
        assert!(kubernetes(&glue("/home/a.toml", &[], "/share/a.tdb")).is_err());
        let text = kubernetes(&all).unwrap();
        for part in ["completions: 4", "mountPath: \"/share\"", "name: tiefort-fort-irwin-2\n", "memory: 189Mi"] {
            assert!(text.contains(part), "{part:?} is not in: {text}");
        }
    }

    #[test]
    fn names_are_those_of_hosts() {
        assert_eq!([name_of("Ä-9"), name_of("__")], ["tiefort-9", "tiefort"]);
    }
}
