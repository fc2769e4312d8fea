//! Every command that the README tells a user to type is typed by `.ci/run`, and works.

fn read(path: &str) -> String {
    std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// The lines of the README's `sh` blocks that are commands.
fn commands(readme: &str) -> Vec<&str> {
    let mut inside = false;
    let mut commands = Vec::new();
    for line in readme.lines() {
        if line.starts_with("```") {
            inside = line == "```sh";
        } else if inside && !line.trim().is_empty() && !line.starts_with('#') {
            commands.push(line.trim());
        }
    }
    commands
}

#[test]
fn every_command_is_run_by_ci() {
    let (readme, ci) = (read("README.md"), read(".ci/run"));
    let run: Vec<&str> = ci.lines().map(str::trim).filter(|line| !line.starts_with('#')).collect();
    let commands = commands(&readme);
    assert!(commands.len() >= 2, "the README has lost its commands");
    for command in commands {
        assert!(run.iter().any(|line| line.contains(command)), ".ci/run does not run `{command}`");
    }
}

#[test]
fn every_subcommand_is_explained() {
    let readme = read("README.md");
    for subcommand in ["bake", "shot", "render", "view", "export", "probe", "verify", "info", "validate"] {
        assert!(readme.contains(&format!("`halflight {subcommand}")), "{subcommand}");
        let help = crate::fixture::run(&[subcommand, "--help"]);
        assert!(!help.stdout.is_empty() && help.stderr.is_empty());
    }
}
