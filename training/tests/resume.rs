//! A run that was stopped and resumed equals the run that was not, bit for bit.

use std::path::Path;

use rayon::ThreadPoolBuilder;
use swath_training::TrainingError;
use swath_training::checkpoint;
use swath_training::config::RunConfig;
use swath_training::stop::Stop;
use swath_training::store::Content;
use swath_training::trainer::Trainer;
use swath_training::weights;
use tch::Device;

const TOY: &str = r#"
name = "toy"
seed = 3
steps = 1000
environment = { kind = "toy", tokens = 4 }
network = { kind = "hop-ppo", dim = 8, heads = 2, layers = 1, feed_forward = 8, head = "pointer", discrete = [8], continuous = [8], critic = [8] }
rollout = { environments = 4, group = 2, stagger = 15 }
ppo = { batch = 60, minibatch = 16, epochs = 2, learning_rate = 1e-3, learning_rate_end = 1e-4, kl_penalty = { coefficient = 0.2, target = 0.01 } }
"#;

const STRIPS: &str = r#"
name = "strips"
seed = 3
steps = 1000
[environment]
kind = "strips"
episode = { orbits = 0.2, scenario = { count = [300, 500] } }
[network]
kind = "h-ppo"
encoder = [16]
discrete = [8]
continuous = [8]
critic = [8]
[rollout]
environments = 2
group = 1
[ppo]
batch = 30
minibatch = 15
epochs = 2
"#;

fn run(text: &str) -> RunConfig {
    toml::from_str(text).unwrap()
}

fn advance(trainer: &mut Trainer, times: usize) {
    for _ in 0..times {
        trainer.advance().unwrap();
    }
}

/// The whole state, as the bytes of a checkpoint.
fn bytes(trainer: &Trainer, folder: &Path) -> Vec<u8> {
    let path = folder.join("state.safetensors");
    checkpoint::save(trainer, &path).unwrap();
    std::fs::read(path).unwrap()
}

fn resumed_equals_uninterrupted(text: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("middle.safetensors");
    let one = ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    one.install(|| {
        tch::set_num_threads(1);
        let mut whole = Trainer::new(run(text), Device::Cpu).unwrap();
        advance(&mut whole, 2);
        checkpoint::save(&whole, &path).unwrap();
        advance(&mut whole, 3);
        let mut resumed = checkpoint::resume(run(text), &path, Device::Cpu).unwrap();
        advance(&mut resumed, 3);
        assert_eq!(whole.steps(), resumed.steps());
        assert_eq!(bytes(&whole, folder.path()), bytes(&resumed, folder.path()));
    });
}

/// Strips with a warm start in which the teacher sometimes waits, and remembers what failed.
fn taught() -> String {
    let strips = STRIPS.replace("orbits = 0.2", "orbits = 0.6").replace("[300, 500]", "[100, 150]");
    format!("{strips}[warm_start]\ndecisions = 200\nlearning_rate = 1e-3\nteacher = \"lookahead\"\n")
}

#[test]
fn a_warm_start_resumed_anywhere_is_bit_equal() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("middle.safetensors");
    for run_text in [taught(), format!("{TOY}warm_start = {{ decisions = 400, learning_rate = 1e-3 }}\n")] {
        let run = || run(&run_text);
        let mut whole = Trainer::new(run(), Device::Cpu).unwrap();
        let lessons = std::iter::from_fn(|| whole.lesson().unwrap()).count();
        assert!(lessons > 4);
        advance(&mut whole, 2);
        for begun in [0, 1, lessons - 1, lessons] {
            let mut trainer = Trainer::new(run(), Device::Cpu).unwrap();
            (0..begun).for_each(|_| assert!(trainer.lesson().unwrap().is_some()));
            checkpoint::save(&trainer, &path).unwrap();
            let mut resumed = checkpoint::resume(run(), &path, Device::Cpu).unwrap();
            assert_eq!(resumed.lessons_shown(), trainer.lessons_shown());
            assert_eq!(resumed.lessons_shown().is_none(), begun == lessons);
            let left = std::iter::from_fn(|| resumed.lesson().unwrap()).count();
            assert_eq!(begun + left, lessons);
            advance(&mut resumed, 2);
            assert_eq!(bytes(&whole, folder.path()), bytes(&resumed, folder.path()), "after {begun} lessons");
        }
    }
}

#[test]
fn a_trainer_that_is_stopped_keeps_what_it_was_before_the_update() {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("{TOY}warm_start = {{ decisions = 60, learning_rate = 1e-3 }}\n");
    let mut trainer = Trainer::new(run(&text), Device::Cpu).unwrap();
    let stop = Stop::default();
    trainer.stop_on(stop.clone());
    for lesson in [true, false] {
        let before = bytes(&trainer, folder.path());
        stop.request();
        let stopped = if lesson { trainer.lesson().map(|_| ()) } else { trainer.advance().map(|_| ()) };
        assert!(matches!(stopped, Err(TrainingError::Stopped)));
        assert_eq!(bytes(&trainer, folder.path()), before);
        assert!(matches!(trainer.advance(), Err(TrainingError::Stopped)), "it does not go on half-way");
        assert_eq!(trainer.lessons_shown(), lesson.then_some(0));
        trainer = Trainer::restore(run(&text), Device::Cpu, trainer.state().unwrap()).unwrap();
        trainer.warm_start(|_| {}).unwrap();
        trainer.stop_on(stop.clone());
    }
}

#[test]
fn a_checkpoint_within_a_warm_start_is_not_taken_for_its_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lesson.safetensors");
    let text = format!("{TOY}warm_start = {{ decisions = 400, learning_rate = 1e-3 }}\n");
    let mut trainer = Trainer::new(run(&text), Device::Cpu).unwrap();
    trainer.lesson().unwrap();
    checkpoint::save(&trainer, &path).unwrap();
    let version = |path: &Path| weights::header(&Content::read(path).unwrap(), path).unwrap().version;
    assert_eq!((version(&path), checkpoint::file_name(&trainer).as_str()), (2, "lesson-000000000060.safetensors"));
    checkpoint::save_policy(&trainer, &path).unwrap();
    assert_eq!(version(&path), 1, "a policy is a policy");
    trainer.warm_start(|_| {}).unwrap();
    checkpoint::save(&trainer, &path).unwrap();
    assert_eq!((version(&path), checkpoint::file_name(&trainer).as_str()), (1, "step-000000000000.safetensors"));
}

#[test]
fn a_resumed_run_is_bit_equal_on_the_toy() {
    resumed_equals_uninterrupted(TOY);
}

#[test]
fn a_resumed_run_is_bit_equal_on_strips_over_ends_of_episodes() {
    resumed_equals_uninterrupted(STRIPS);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let state = |threads: usize| {
        let pool =
            ThreadPoolBuilder::new().num_threads(threads).start_handler(|_| tch::set_num_threads(1)).build().unwrap();
        pool.install(|| {
            let mut trainer = Trainer::new(run(TOY), Device::Cpu).unwrap();
            advance(&mut trainer, 3);
            bytes(&trainer, folder.path())
        })
    };
    assert_eq!(state(1), state(3));
}

#[test]
fn another_seed_gives_another_run() {
    let folder = tempfile::tempdir().unwrap();
    let mut other = run(TOY);
    other.seed = 4;
    let mut trainers = [run(TOY), other].map(|run| Trainer::new(run, Device::Cpu).unwrap());
    trainers.iter_mut().for_each(|trainer| advance(trainer, 1));
    let weights = trainers.map(|trainer| trainer.state().unwrap().weights);
    assert_ne!(weights[0], weights[1]);
    assert!(folder.path().exists());
}

#[test]
fn a_checkpoint_of_another_run_is_refused_with_the_setting_that_differs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.safetensors");
    checkpoint::save(&Trainer::new(run(TOY), Device::Cpu).unwrap(), &path).unwrap();
    let refused = |change: fn(&mut RunConfig)| {
        let mut run = run(TOY);
        change(&mut run);
        checkpoint::resume(run, &path, Device::Cpu).map(|_| ())
    };
    let error = refused(|run| run.ppo.clip = 0.3).unwrap_err();
    let TrainingError::Mismatch { key, found, wanted, .. } = error else {
        panic!("{error}");
    };
    assert_eq!((key.as_str(), found.as_str(), wanted.as_str()), ("ppo.clip", "0.2", "0.3"));
    assert!(matches!(
        refused(|run| run.seed = 9).unwrap_err(),
        TrainingError::Mismatch { key, .. } if key == "seed"
    ));
    refused(|run| run.steps = 5000).unwrap();
}

#[test]
fn damaged_and_missing_checkpoints_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cut.safetensors");
    let trainer = Trainer::new(run(TOY), Device::Cpu).unwrap();
    checkpoint::save(&trainer, &path).unwrap();
    let whole = std::fs::read(&path).unwrap();
    std::fs::write(&path, &whole[..whole.len() / 2]).unwrap();
    let refused = || checkpoint::resume(run(TOY), &path, Device::Cpu).map(|_| ()).unwrap_err();
    assert!(refused().to_string().contains("cut.safetensors is damaged"));
    checkpoint::save_policy(&trainer, &path).unwrap();
    assert!(refused().to_string().contains("it is a policy"));
    let error = checkpoint::newest(folder.path()).unwrap_err().to_string();
    assert!(error.contains("holds no checkpoint"), "{error}");
}

#[test]
fn weights_that_are_not_finite_stop_the_run_with_the_step() {
    let mut trainer = Trainer::new(run(TOY), Device::Cpu).unwrap();
    advance(&mut trainer, 1);
    let mut state = trainer.state().unwrap();
    state.weights[0] = f32::NAN;
    let mut trainer = Trainer::restore(run(TOY), Device::Cpu, state).unwrap();
    let error = trainer.advance().map(|_| ()).unwrap_err();
    assert!(matches!(error, TrainingError::NotFinite { step: 60, .. }), "{error}");
}
