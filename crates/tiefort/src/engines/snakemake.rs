//! A Snakefile: one process a task, on one host or wherever Snakemake's executors start it.

use std::path::Path;

use super::glue::{Glue, literal};

const BODY: &str = r#"

def mark(name):
    """The file that says that a task was done."""
    return f"{OUT}.marks/{name}"


def command(wildcards):
    words = f"{quote(TIEFORT)} task {quote(JOB)} {TASKS[wildcards.name][0]} --out {quote(OUT)} --workers 1 --quiet"
    # Breaches are a result: publishing with some of them is a success.
    return f"{words} || [ $? -eq 1 ]" if wildcards.name == "publish" else words


rule all:
    input:
        lambda wildcards: mark("publish"),


# A task that finds what it needs not done yet, or is killed, is tried again: running one twice does no harm.
rule task:
    input:
        lambda wildcards: [JOB, *SOURCES, *map(mark, TASKS[wildcards.name][1])],
    output:
        touch(OUT.replace("{", "{{").replace("}", "}}") + ".marks/{name}"),
    wildcard_constraints:
        name="[a-z]+(-r[0-9]+c[0-9]+)?",
    params:
        command=command,
    resources:
        mem_mb=MEMORY_MB,
    retries: 5
    shell:
        "{params.command}"
"#;

/// The Snakefile.
pub fn snakemake(glue: &Glue) -> String {
    let (rows, columns) = glue.tiles;
    let mut text = format!(
        "# Gaming area {} in {rows} x {columns} tiles, for Snakemake 8 or newer: `snakemake -s THIS_FILE --cores 4`.\n\
         # A task leaves a mark beside the database; delete the marks to have every task look again.\n\
         # Every host has to see the same paths.\n\
         import os\nfrom shlex import quote\n\n",
        glue.area
    );
    text += &format!("TIEFORT = os.environ.get(\"TIEFORT\", {})\n", literal(&glue.program));
    text += &format!("JOB = {}\nOUT = {}\n", literal(&glue.job), literal(&glue.out));
    let sources: Vec<String> = glue.sources.iter().map(|path| literal(path)).collect();
    text += &format!("SOURCES = [{}]\nMEMORY_MB = {}\n\n", sources.join(", "), glue.task_mebibytes());
    text += "# Words of each task, and those it waits for.\nTASKS = {\n";
    for task in &glue.tasks {
        let after: Vec<String> =
            task.after.iter().map(|&other| literal(Path::new(&glue.tasks[other].name()))).collect();
        text += &format!("    \"{}\": (\"{}\", [{}]),\n", task.name(), task.words(), after.join(", "));
    }
    text + "}\n" + BODY
}
