//! A script that submits a build to Slurm, and that each of its jobs runs again to do its part.
//!
//! Jobs wait for jobs, never for arrays: a dependency on an array stays stuck after one of it was requeued. They wait
//! for the *end* of those before them, not for their success, and `tiefort task` looks at the database itself: after a
//! crash the controller has forgotten jobs that ended, and runs others a second time. The last job makes whatever is
//! still missing.

use std::fmt::Write;

use super::glue::{Glue, shell_word};

const HEAD: &str = r#"
# How often a task is tried while what it needs is not done yet, and the seconds in between.
attempts=${TIEFORT_ATTEMPTS:-6}
pause=${TIEFORT_PAUSE:-5}

# Inside a job: does one task.
unit() {
    local attempt code
    for ((attempt = 1; ; attempt++)); do
        code=0
        "$tiefort" task "$job" "$@" --out "$out" --workers "${SLURM_CPUS_PER_TASK:-1}" || code=$?
        # 75: not yet. Anything else is an end: 0 done, 1 published with breaches, 2 failed.
        if ((code != 75 || attempt >= attempts)); then
            break
        fi
        sleep "$pause"
    done
    if [[ $1 == publish && $code -le 1 ]]; then
        "$tiefort" report "$out" || true
        return 0
    fi
    return "$code"
}

if [[ ${1:-} == unit ]]; then
    shift
    unit "$@"
    exit
fi

# On the machine that submits: `submit NAME AFTER WORDS…` gives the number of the job. More options for sbatch may be
# given in SBATCH_OPTIONS, such as --partition or --time.
mkdir -p "$logs"
submit() {
    local name=$1 after=$2
    shift 2
    # shellcheck disable=SC2086
    sbatch --parsable --requeue --ntasks=1 --job-name "$area-$name" --output "$logs/$name.%j.txt" \
        ${after:+--dependency=afterany:$after} --mem "$memory" ${SBATCH_OPTIONS:-} "$script" unit "$@"
}
"#;

/// The script.
pub fn slurm(glue: &Glue) -> String {
    let (rows, columns) = glue.tiles;
    let mut text = format!(
        "#!/usr/bin/env bash\n# Gaming area {} in {rows} x {columns} tiles, for Slurm: `bash THIS_FILE` submits\n\
         # {} jobs and prints the number of the last one. Every host has to see the same paths.\n\
         set -euo pipefail\n\n",
        glue.area,
        glue.tasks.len()
    );
    let logs = format!("{}.slurm", glue.out.display());
    for (name, value) in [
        ("tiefort", format!("${{TIEFORT:-{}}}", plain(&glue.program.to_string_lossy()))),
        ("job", shell_word(&glue.job)),
        ("out", shell_word(&glue.out)),
        ("logs", shell_word(std::path::Path::new(&logs))),
        ("area", shell_word(std::path::Path::new(&glue.area))),
        ("memory", format!("${{TIEFORT_MEMORY:-{}M}}", glue.task_mebibytes())),
        ("script", "${BASH_SOURCE[0]}".into()),
    ] {
        writeln!(text, "{name}={value}").expect("a text takes all that is written to it");
    }
    text += HEAD;
    for (place, task) in glue.tasks.iter().enumerate() {
        let after: Vec<String> = task.after.iter().map(|other| format!("$j{other}")).collect();
        text += &format!("j{place}=$(submit {} \"{}\" {})\n", task.name(), after.join(":"), task.words());
    }
    text + &format!("echo \"$j{}\"\n", glue.tasks.len().saturating_sub(1))
}

/// A path inside `${…:-…}`, where quotes would be part of it.
fn plain(path: &str) -> String {
    let special = |character: char| !character.is_ascii_alphanumeric() && !"/._-".contains(character);
    path.chars().flat_map(|c| special(c).then_some('\\').into_iter().chain([c])).collect()
}
