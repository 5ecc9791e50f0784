"""The package against a real farm: a coordinator and a worker that renders."""

import asyncio
import hashlib
import json
import socket

import exr_layers
import numpy as np
import pytest
from cli_kit import FOG, digest, lightshaft as command, write_fog
from local_farm import SCENE, LocalFarm, bin_dir, wait_until

import lightshaft
from lightshaft import submission, transport

BALL = {
    "type": "scene",
    "integrator": {"type": "volpath"},
    "sensor": {
        "type": "perspective",
        "fov": 45,
        "to_world": [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 4], [0, 0, 0, 1]],
        "sampler": {"type": "independent", "sample_count": 16},
        "film": {"type": "hdrfilm", "width": 96, "height": 64, "rfilter": {"type": "box"}},
    },
    "ball": {"type": "sphere", "bsdf": {"type": "diffuse"}},
    "sky": {"type": "constant"},
}


@pytest.fixture(scope="module")
def fog(tmp_path_factory):
    """A scene file with a grid beside it."""
    return write_fog(tmp_path_factory.mktemp("fog"))


def pixels(job):
    return job.wait().report()["pixels_sha256"]


def test_a_file_with_what_it_names_has_the_pixels_of_the_command(farm, fog, tmp_path):
    expected = digest(command("render", fog, "-o", tmp_path / "out.exr", "--spp", 4))

    assert pixels(farm.submit(fog, spp=4)) == expected
    assert pixels(farm.submit(str(fog), spp=4)) == expected
    assert pixels(farm.submit(FOG, spp=4, folder=fog.parent)) == expected
    assert (
        pixels(farm.submit(FOG, spp=4, assets={"fog.vol": (fog.parent / "fog.vol").read_bytes()}))
        == expected
    )


def test_included_files_and_frames_and_defines_are_sent(farm, fog, tmp_path):
    inside = tmp_path / "scene"
    (inside / "parts").mkdir(parents=True)
    (inside / "parts/fog.xml").write_text(FOG.replace("fog.vol", "grids/fog_##.vol"))
    for frame in (3, 4):
        (inside / f"grids/fog_{frame:02}.vol").parent.mkdir(exist_ok=True)
        (inside / f"grids/fog_{frame:02}.vol").write_bytes((fog.parent / "fog.vol").read_bytes())
    (inside / "main.xml").write_text(
        '<scene version="3.0.0"><include filename="parts/$what$n.xml"/></scene>'
    )
    (inside / "parts/fog.xml").rename(inside / "parts/fog7.xml")

    job = farm.submit(
        inside / "main.xml", spp=2, frames="3-4", defines={"density": 3, "what": "fog", "n": 7}
    )

    frames = job.wait().frames()
    one = farm.submit(inside / "main.xml", spp=2, frames=4, defines={"density": 3, "what": "fog", "n": 7})
    assert pixels(one.wait().frames()[0]) == pixels(frames[1])
    assert [frame.view["frame"] for frame in frames] == [3, 4] and all(
        frame.state == "done" for frame in frames
    )
    assert frames[0].image().shape == (40, 72, 3) and "<img" in job._repr_html_()


def test_a_dictionary_has_the_pixels_of_the_same_scene_as_text(farm):
    jobs = [farm.submit(scene, spp=16) for scene in (SCENE, BALL, lightshaft.scene_of_dict(BALL).xml)]

    text, dictionary, written = map(pixels, jobs)

    assert text == dictionary == written
    assert np.array_equal(jobs[0].image(), jobs[1].image())


def test_what_meters_measure_is_listed(farm):
    """Under a constant environment of radiance 2 the irradiance is 2 pi."""
    sky = {
        "type": "scene",
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 2}},
        "roof": {"type": "irradiancemeter", "points": "0 0 0 0 0 1; 1 2 3 0 1 0"},
    }
    meters = farm.submit(sky, spp=4).wait().meters()

    assert [m["name"] for m in meters] == ["roof[1]", "roof[2]"]
    assert meters[1]["value"] == pytest.approx([2 * np.pi] * 3, rel=1e-5)  # float32 along a short path


def test_layers_are_those_of_the_file(farm, fog, tmp_path):
    job = farm.submit(fog, spp=4, aov=["depth", "normal", "shape_id", "uv"]).wait()
    job.save(tmp_path / "image.exr")
    rows, strings, _ = exr_layers.read(tmp_path / "image.exr")

    layers = job.layers()

    channels = {
        "color": "RGB",
        "stderr": "RGB",
        "depth": "Z",
        "normal": "XYZ",
        "uv": "UV",
        "spp": None,
        **{f"crypto_object{i:02}": "RGBA" for i in range(3)},
    }
    assert set(layers) == set(channels)
    for name, letters in channels.items():
        names = [name] if letters is None else [c if name == "color" else f"{name}.{c}" for c in letters]
        expected = np.stack([np.array(rows[channel]) for channel in names], axis=-1)
        assert np.array_equal(layers[name].reshape(expected.shape), expected), name
    assert len(rows) == sum(1 if letters is None else len(letters) for letters in channels.values())
    assert np.array_equal(job.image(), layers["color"]) and job.image().dtype == np.float32
    assert (
        layers["depth"].shape == (40, 72)
        and layers["spp"].dtype == np.uint32
        and (layers["spp"] == 4).all()
    )
    assert strings["lightshaft:seed"] == "0"
    with pytest.raises(lightshaft.NotFound, match="'denoised'; it has color"):
        job.image("denoised")


def test_layers_in_parts_are_the_same_layers(farm, fog):
    settings = {"spp": 2, "aov": ["depth", "shape_id"]}
    whole = farm.submit(fog, **settings).wait().layers()
    parts = farm.submit(fog, **settings, exr_parts="layers", exr_compression="piz").wait().layers()

    assert list(parts) == list(whole)
    assert all(np.array_equal(parts[name], whole[name]) for name in whole)


def test_a_denoised_job_has_the_denoised_image(tmp_path):
    library = bin_dir().parent / "fake_oidn" / "blurs.so"
    with LocalFarm(tmp_path / "farm", environment={"LIGHTSHAFT_OIDN": str(library)}) as local:
        local.add_worker(fake=False)
        with lightshaft.Farm(local.url(), local.token) as farm:
            job = farm.submit(SCENE, spp=4, denoise=True).wait()

            assert job.image("denoised").shape == job.image().shape
            assert not np.array_equal(job.image("denoised"), job.image())
            assert job.png(denoised=True) != job.png()


def test_progress_goes_to_a_function_or_to_the_standard_error_stream(farm, capsys):
    seen = []
    job = farm.submit(SCENE, spp=64).wait(progress=seen.append)

    assert seen[-1]["state"] == "done" == job.state and job.view == seen[-1]
    assert [view["progress"] for view in seen] == sorted(view["progress"] for view in seen)
    job.wait(progress=True)
    assert capsys.readouterr().err.startswith("done 100 %, 64 samples per pixel, relMSE ")


def test_a_wait_goes_on_over_a_restart_of_the_coordinator(tmp_path, monkeypatch):
    with LocalFarm(tmp_path) as local, lightshaft.Farm(local.url(), local.token) as farm:
        job = farm.submit(SCENE, spp=4)
        views, failures = [], []

        def kill_at_first(view):
            if not views:
                local.coordinator.kill()
            views.append(view)

        send = transport.SyncTransport._send

        def start_after_a_failure(self, call):
            try:
                return send(self, call)
            except lightshaft.FarmUnreachable as error:
                if not failures:
                    local.start_coordinator()
                    local.add_worker(fake=False)
                failures.append(error)
                raise

        monkeypatch.setattr(transport.SyncTransport, "_send", start_after_a_failure)

        assert job.wait(progress=kill_at_first).state == "done"

        assert views[0]["state"] == "queued" and failures


def test_a_job_is_changed_and_removed(farm, local_farm):
    job = farm.submit(SCENE, spp=1 << 20)
    with pytest.raises(lightshaft.WaitTimeout, match="it continues"):
        job.wait(timeout=0)
    assert job.pause().state == "paused" and job.resume().state in ("queued", "running")
    assert job.prioritise(7).view["priority"] == 7
    job.cancel()
    with pytest.raises(lightshaft.JobCancelled, match=job.id):
        job.wait()
    with pytest.raises(lightshaft.Conflict):
        job.resume()

    short = farm.submit(SCENE, spp=8).wait()
    longer = pixels(short.extend(spp=16))
    assert longer == pixels(farm.submit(SCENE, spp=16))
    with pytest.raises(lightshaft.RequestRejected, match="either spp"):
        short.extend()

    running = farm.submit(SCENE, spp=1 << 20)
    for gone in (job, short, running):
        gone.remove()
        with pytest.raises(lightshaft.NotFound):
            farm.job(gone.id)
    assert not {job.id, short.id, running.id} & {other.id for other in farm.jobs()}
    (worker,) = farm.workers()
    assert worker["name"] == "worker-1"
    assert " connected: " in farm.worker_log(worker["id"])
    with pytest.raises(lightshaft.NotFound):
        farm.worker_log("w-0-0-nobody")
    with pytest.raises(lightshaft.NotFound):
        farm.restart_worker("w-0-0-nobody")
    farm.restart_worker(worker["id"])
    wait_until(lambda: any(w["state"] == "connected" and w["id"] != worker["id"] for w in farm.workers()), "it is back")


def test_figures_come_as_arrays_and_text(farm):
    job = farm.submit(SCENE, spp=16).wait()

    curve = job.convergence()

    assert list(curve["spp"]) == [2, 4, 8, 16] and np.isnan(curve["true_relmse"]).all()
    assert curve["relmse"][-1] == pytest.approx(job.report()["relmse"])  # written with fewer digits
    assert len(job.tiles()) == job.view["units_total"] // 4 and job.id in repr(job)
    assert job.log() and job.png().startswith(b"\x89PNG") and job.png(exposure=2) != job.png()


def test_a_reference_is_sent_from_its_file(farm, tmp_path):
    farm.submit(SCENE, spp=64, seed=1).wait().save(tmp_path / "ref.exr")

    job = farm.submit(SCENE, spp=4, reference=str(tmp_path / "ref.exr")).wait()

    assert np.isfinite(job.convergence()["true_relmse"][-1])


# ---- errors ----


def test_a_rejected_scene_tells_every_place(farm, tmp_path):
    scene = tmp_path / "ball.xml"
    scene.write_text(SCENE.replace('"fov"', '"fow"').replace('"diffuse"', '"difuse"'))

    with pytest.raises(lightshaft.SceneRejected) as error:
        farm.submit(scene)

    first, second = error.value.diagnostics
    assert (
        (error.value.file, error.value.line, error.value.column)
        == ("ball.xml", 4, 18)
        == (first.file, first.line, first.column)
    )
    assert second.line > 4 and "did you mean 'diffuse'?" in second.text
    assert str(error.value).splitlines()[:3] == [
        "ball.xml:4:18: error: sensor \"perspective\" has no parameter 'fow'; did you mean 'fov'?",
        '  4 |     <float name="fow" value="45"/>',
        "    |                  ^~~",
    ]
    assert error.value.status == 400 and error.value.path is None


def test_a_missing_file_is_told_with_its_place(farm):
    with pytest.raises(lightshaft.SceneRejected, match="fog.vol") as error:
        farm.submit(FOG, folder="/nonexistent")
    assert error.value.line == FOG[: FOG.index("fog.vol")].count("\n") + 1


def test_what_the_farm_finds_odd_is_a_warning(farm):
    with pytest.warns(lightshaft.SceneWarning, match="nothing in the scene asks for .*nothing_asks"):
        farm.submit(SCENE, spp=2, defines={"nothing_asks": 1})


def test_an_error_of_a_dictionary_tells_its_keys(farm):
    with pytest.raises(lightshaft.SceneRejected) as error:
        farm.submit(
            {
                **BALL,
                "ball": {
                    "type": "sphere",
                    "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 2}},
                },
            }
        )
    assert error.value.path == "ball.bsdf.reflectance" and str(error.value).startswith(
        "ball.bsdf.reflectance: error: "
    )


@pytest.mark.parametrize(
    "spec, words",
    [
        ({"spq": 3}, "did you mean 'spp'?"),
        ({"size": (0, 3)}, "size"),
        ({"spp": "many"}, "spp"),
        ({"defines": ["a"]}, "defines"),
        ({"frames": [3]}, "frames"),
        ({"seed": {1}}, "a set cannot"),
    ],
)
def test_a_wrong_setting_is_told(farm, spec, words):
    with pytest.raises(lightshaft.RequestRejected, match="(?s).*" + words.replace("?", r"\?")):
        farm.submit(SCENE, **spec)


def test_what_is_no_scene_is_told(farm, tmp_path):
    for scene, words in (
        (tmp_path / "none.xml", "there is no file"),
        (tmp_path, "cannot be read|not a regular file"),
    ):
        with pytest.raises(lightshaft.FileRefused, match=words):
            farm.submit(scene)
    with pytest.raises(lightshaft.RequestRejected, match="not a int"):
        farm.submit(3)


def test_tokens(local_farm):
    for token, kind in (("0" * 64, lightshaft.Unauthorised), ("", lightshaft.Unauthorised)):
        with pytest.raises(kind, match="LIGHTSHAFT_TOKEN"):
            lightshaft.Farm(local_farm.url(), token).jobs()
    reader = local_farm.request("POST", "/api/v1/tokens", b'{"role": "read", "user": "rita"}')
    with lightshaft.Farm(local_farm.url(), json.loads(reader)["token"]) as farm:
        with pytest.raises(lightshaft.Forbidden):
            farm.submit(SCENE)
    with pytest.raises(lightshaft.RequestRejected, match="characters"):
        lightshaft.Farm(local_farm.url(), "a\nb")


def test_a_farm_that_is_down_is_named(local_farm):
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # nobody else gets the port, and nobody listens
        dead = f"http://127.0.0.1:{held.getsockname()[1]}"
        with pytest.raises(lightshaft.FarmUnreachable, match=dead + ".*Is a coordinator running there"):
            lightshaft.Farm(dead, "x").jobs()
        with lightshaft.Farm(
            f"{dead},{local_farm.url()}", local_farm.token
        ) as farm:  # the next one answers
            assert farm.workers()
    with pytest.raises(lightshaft.RequestRejected, match="http://"):
        lightshaft.Farm("ftp://localhost:8080", "x")


def test_certificates_are_checked(tmp_path):
    with LocalFarm(tmp_path, tls=True) as local:
        with lightshaft.Farm(local.url(), local.token, ca=local.secrets / "tls/ca.pem") as farm:
            assert farm.jobs() == []
        with pytest.raises(lightshaft.FarmUnreachable, match="(?i)certificate"):
            lightshaft.Farm(local.url(), local.token).jobs()
    with pytest.raises(lightshaft.RequestRejected, match="no-ca.pem"):
        lightshaft.Farm("https://farm", "x", ca="no-ca.pem")


def test_a_job_that_fails_says_why(farm):
    mesh = '<shape type="ply"><string name="filename" value="m.ply"/></shape><emitter type="constant"/>'

    job = farm.submit(
        SCENE.replace('<emitter type="constant"/>', mesh), spp=2, assets={"m.ply": b"ply\nno mesh at all"}
    )

    with pytest.raises(lightshaft.JobFailed, match="m.ply") as error:
        job.wait()
    assert job.refresh()["state"] == "failed" and job.id in error.value.message


# ---- uploads ----


@pytest.fixture
def sent(monkeypatch):
    """The requests that are sent."""
    calls = []
    send = transport.SyncTransport._send

    def spy(self, call):
        calls.append(call)
        return send(self, call)

    monkeypatch.setattr(transport.SyncTransport, "_send", spy)
    return calls


def test_a_large_file_goes_in_parts_from_where_an_earlier_upload_ended(farm, sent, monkeypatch):
    data = b"ply\n" + bytes(range(256)) * 40
    digest_of_it = hashlib.sha256(data).hexdigest()
    monkeypatch.setattr(submission, "UPLOAD_PART_BYTES", 4096)
    path = f"/api/v1/blobs/{digest_of_it}"
    begun = submission.Call(
        "PUT", path, data[:1000], "application/octet-stream", {"Content-Range": f"bytes 0-999/{len(data)}"}
    )
    assert farm._transport.run(submission.succeed(begun)).status == 202
    sent.clear()

    farm._transport.run(submission._send_missing({digest_of_it: submission.Source.of_bytes(data)}))

    ranges = [call.headers["Content-Range"] for call in sent if call.method == "PUT"]
    assert ranges == [
        f"bytes 1000-5095/{len(data)}",
        f"bytes 5096-9191/{len(data)}",
        f"bytes 9192-{len(data) - 1}/{len(data)}",
    ]
    sent.clear()
    farm._transport.run(submission._send_missing({digest_of_it: submission.Source.of_bytes(data)}))
    assert [call.method for call in sent] == ["POST"], "what is there is not sent again"


# ---- event loops ----


def test_the_same_on_an_event_loop(local_farm, fog):
    async def run():
        async with lightshaft.AsyncFarm(local_farm.url(), local_farm.token) as farm:
            jobs = await asyncio.gather(
                farm.submit(SCENE, spp=16), farm.submit(BALL, spp=16), farm.submit(fog, spp=2)
            )
            await asyncio.gather(*(job.wait() for job in jobs))
            with pytest.raises(lightshaft.SceneRejected) as rejected:
                await farm.submit(SCENE.replace("fov", "fow"))
            with pytest.raises(lightshaft.NotFound):
                await farm.job("j-none")
            reports = [await job.report() for job in jobs]
            shown = await jobs[0].snapshot()
            assert (await jobs[2].image()).shape == (40, 72, 3)
            assert [job.id for job in await farm.jobs()].count(jobs[0].id) == 1
            await jobs[1].extend(spp=32)
            await jobs[2].remove()
            return [report["pixels_sha256"] for report in reports], rejected.value.line, shown._repr_html_()

    (text, dictionary, _), line, html = asyncio.run(run())

    assert text == dictionary and line == 4 and "<svg" in html


def test_both_farms_have_the_same_methods():
    def methods(kind):
        return {name for name in vars(kind) if not name.startswith("_")}

    assert methods(lightshaft.Farm) == methods(lightshaft.AsyncFarm)
    assert methods(lightshaft.Job) == methods(lightshaft.AsyncJob)


def test_jobs_are_chosen_by_state_name_and_order(farm):
    waiting = [farm.submit(SCENE, name=name, spp=4, tags=["nobody"]) for name in ("chapel", "hall")]
    ids = [job.id for job in waiting]
    waiting[1].pause()

    assert [job.id for job in farm.jobs(search="chapel")] == ids[:1]
    assert [job.id for job in farm.jobs(state=["paused"], search="hall")] == ids[1:]
    assert [job.id for job in farm.jobs(sort="-submitted", limit=2)] == ids[::-1]
    assert [job.id for job in farm.jobs(sort="-submitted", limit=1, offset=1)] == ids[:1]
    assert repr(waiting[0]) == f"<Job {ids[0]} 'chapel': queued, 0 %>"
    with pytest.raises(lightshaft.RequestRejected, match="unknown word"):
        farm.jobs(state="runing")
    for job in waiting:
        job.remove()


def test_a_job_waits_for_others_until_they_are_done(farm):
    first = farm.submit(SCENE, spp=4, tags=["nobody"])
    second = farm.submit(SCENE, spp=4, after=[first.id])
    assert second.view["after"] == [{"id": first.id, "state": "queued"}]
    assert second.view["waits_for"] == f"waits for job {first.id}, which is queued"
    with pytest.raises(lightshaft.RequestRejected, match="would wait for itself"):
        first.wait_for(second)

    assert second.wait_for().view["after"] == []
    assert second.wait().state == "done"
    assert first.wait_for(second).view["after"] == []
    first.remove()
