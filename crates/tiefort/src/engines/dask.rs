//! A Python program that runs a build on a Dask cluster.

use super::glue::{Glue, literal};

const BODY: &str = r#"

def unit(words, *needs):
    """Runs one task on a worker, again while what it needs is not done yet."""
    command = [TIEFORT, "task", JOB, *words, "--out", OUT, "--workers", "1", "--quiet"]
    for attempt in range(ATTEMPTS):
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
        # 75: not yet. Publishing with breaches ends with 1 and is a success.
        if done.returncode == 0 or (done.returncode == 1 and words[0] == "publish"):
            return done.returncode
        if done.returncode != 75:
            break
        time.sleep(PAUSE_S)
    raise RuntimeError(f"{' '.join(words)}: exit {done.returncode}: {done.stderr.strip()}")


def main():
    # Without an address, as many workers as this machine has cores.
    client = Client(sys.argv[1]) if len(sys.argv) == 2 else Client()
    futures = []
    for words, after in TASKS:
        needs = [futures[place] for place in after]
        key = f"{'-'.join(words[:2])}-{OUT}"
        futures.append(client.submit(unit, words, *needs, retries=RETRIES, pure=False, key=key))
    code = futures[-1].result()
    client.close()
    sys.exit(code)


if __name__ == "__main__":
    main()
"#;

/// The program.
pub fn dask(glue: &Glue) -> String {
    let (rows, columns) = glue.tiles;
    let mut text = format!(
        "#!/usr/bin/env python3\n\"\"\"Gaming area {} in {rows} x {columns} tiles, for Dask.\n\n    \
         python3 THIS_FILE SCHEDULER:8786\n\nNeeds dask[distributed]. Every worker has to see the same paths. \
         A task that is lost with its worker\nis run again by another one; running one twice does no harm.\n\"\"\"\n\
         import os\nimport subprocess\nimport sys\nimport time\n\nfrom dask.distributed import Client\n\n",
        glue.area
    );
    text += &format!("TIEFORT = os.environ.get(\"TIEFORT\", {})\n", literal(&glue.program));
    text += &format!("JOB = {}\nOUT = {}\n", literal(&glue.job), literal(&glue.out));
    text += "RETRIES, ATTEMPTS, PAUSE_S = 5, 6, 5\n\n";
    text += "# Words of each task, and the places of those it waits for.\nTASKS = [\n";
    for task in &glue.tasks {
        let words: Vec<String> = task.words().split(' ').map(|word| format!("\"{word}\"")).collect();
        text += &format!("    ([{}], {:?}),\n", words.join(", "), task.after);
    }
    text + "]\n" + BODY
}
