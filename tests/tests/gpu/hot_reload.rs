//! Hot reload: a changed source takes effect, a faulty one or one with another interface is refused and the old kernel stays.

use std::path::Path;
use std::time::{Duration, SystemTime};

use clerestory::Error;
use clerestory::gpu::{Category, ComputePipeline, Gpu, HotReload};
use clerestory_tests::shaders::out_of_bounds;
use clerestory_tests::with_gpu;

/// What the kernel writes into word 2 of 4 when it is told to write 5.
fn written(gpu: &Gpu, pipeline: &ComputePipeline<out_of_bounds::Kernel>) -> u32 {
    let words = gpu.buffer_with("words", Category::Work, &[0u32; 4]).unwrap();
    let mut recorder = gpu.recorder("write").unwrap();
    recorder
        .pass("write", |pass| {
            let set = out_of_bounds::Set0 { words: words.view() };
            let push = out_of_bounds::Push { index: 2, value: 5 };
            pass.dispatch(pipeline, &[&set], &push, [1, 1, 1])
        })
        .unwrap();
    recorder.submit().unwrap().wait().unwrap();
    gpu.read(words.view(), 4).unwrap()[2]
}

/// Writes a source with a time of change of its own, whatever the file system's resolution.
fn save(path: &Path, text: &str, turn: u64) {
    std::fs::write(path, text).unwrap();
    let file = std::fs::File::options().write(true).open(path).unwrap();
    file.set_modified(SystemTime::now() + Duration::from_secs(10 * turn))
        .unwrap();
}

#[test]
fn a_changed_source_takes_effect_and_a_faulty_one_does_not() {
    let original = include_str!("../../shaders/out_of_bounds.comp");
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("out_of_bounds.comp");
    let elsewhere = tempfile::tempdir().unwrap();
    save(&source, original, 0);
    with_gpu(|gpu| {
        // SAFETY: the folder is this test's, and no version of the kernel has arrays of its own.
        #[expect(unsafe_code, reason = "kernels from a folder")]
        let mut kernel = unsafe { HotReload::<out_of_bounds::Kernel>::new(gpu, folder.path(), ()) }.unwrap();
        assert!(!kernel.poll().unwrap());
        assert_eq!(written(gpu, kernel.pipeline()), 5);

        save(&source, &original.replace("= value", "= value + 1"), 1);
        assert!(kernel.poll().unwrap());
        assert!(!kernel.poll().unwrap());
        assert_eq!(written(gpu, kernel.pipeline()), 6);

        save(&source, &original.replace("= value", "= valeu"), 2);
        match kernel.poll() {
            Err(Error::Shader { name, message }) => {
                assert_eq!(name, "out_of_bounds.comp");
                assert!(message.contains("valeu"), "{message}");
            }
            other => panic!("expected the compiler's words, got {other:?}"),
        }
        assert!(!kernel.poll().unwrap(), "the same faulty source is not tried twice");
        assert_eq!(written(gpu, kernel.pipeline()), 6);

        let changes = [
            ("uint index;\n    uint value;", "uint value;\n    uint index;"),
            ("binding = 0", "binding = 1"),
            ("writeonly buffer", "buffer"),
            ("local_size_x = 1", "local_size_x = 2"),
        ];
        for (turn, (from, to)) in (3..).zip(changes) {
            assert!(original.contains(from));
            save(&source, &original.replace(from, to), turn);
            match kernel.poll() {
                Err(Error::Shader { message, .. }) => assert!(message.contains("interface"), "{message}"),
                other => panic!("{to}: expected another interface, got {other:?}"),
            }
            assert_eq!(written(gpu, kernel.pipeline()), 6);
        }

        let including = original.replace(
            "layout(local_size_x = 1)",
            "#extension GL_GOOGLE_include_directive : require\n#include \"part/one.glsl\"\nlayout(local_size_x = ONE)",
        );
        std::fs::create_dir_all(elsewhere.path().join("part")).unwrap();
        std::fs::write(elsewhere.path().join("part/one.glsl"), "#define ONE 1\n").unwrap();
        save(&source, &including.replace("= value", "= value + 2"), 8);
        match kernel.poll() {
            Err(Error::Shader { message, .. }) => assert!(message.contains("part/one.glsl"), "{message}"),
            other => panic!("expected a missing include, got {other:?}"),
        }
        kernel = kernel.with_includes(elsewhere.path());
        save(&source, &including.replace("= value", "= value + 2"), 9);
        assert!(kernel.poll().unwrap());
        assert_eq!(written(gpu, kernel.pipeline()), 7);

        save(&source, original, 10);
        assert!(kernel.poll().unwrap());
        assert_eq!(written(gpu, kernel.pipeline()), 5);
        std::fs::remove_file(&source).unwrap();
        assert!(matches!(kernel.poll(), Err(Error::Io { .. })));
        assert_eq!(written(gpu, kernel.pipeline()), 5);
    });
}
