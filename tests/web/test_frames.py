"""A sequence on the dashboard: its frames, the one that is shown, and what events say of them."""
from local_farm import wait_until
from stub_farm import job, png

SEQUENCE = "j-5e9"


def frame_id(frame):
    return f"{SEQUENCE}-frame{frame}"


def frame_job(frame, state="queued", **more):
    return job(frame_id(frame), "smoke.xml", state, sequence=SEQUENCE, frame=frame, **more)


def sequence(farm, states, current):
    """A sequence whose frames are jobs of the stub, too; `states` by frame."""
    listed = []
    for frame, state in states.items():
        one = frame_job(frame, state, progress=1 if state == "done" else 0.25)
        farm.jobs[frame_id(frame)] = one
        listed.append({key: one[key] for key in ("frame", "id", "state", "progress", "spp_done", "relmse", "error")})
    done = sum(state == "done" for state in states.values())
    frames = {"range": "1-4", "total": len(states), "done": done, "running": 1, "failed": 0, "cancelled": 0, "current": current}
    farm.jobs[SEQUENCE] = job(SEQUENCE, "smoke.xml", frames={**frames, "list": listed})
    return frames


def advance(farm, states, current, changed):
    """What the coordinator tells in events, and from then on whoever asks: the page may ask again once its stream is open."""
    frames = sequence(farm, states, current)
    for frame in changed:
        farm.emit("job", farm.jobs[frame_id(frame)])
    whole = {key: value for key, value in farm.jobs[SEQUENCE].items() if key != "frames"}
    farm.emit("job", {**whole, "frames": frames})  # events have no list


def pixel(page):
    return page.evaluate("[...document.querySelector('.stage live-image canvas').getContext('2d').getImageData(5, 5, 1, 1).data]")[:3]


def shown(page):
    return page.evaluate("document.querySelector('.frame[aria-current]')?.dataset.frame")


def test_a_sequence_is_rendered_again_as_a_whole(farm, dashboard):
    sequence(farm, {1: "done", 2: "done"}, 2)
    page = dashboard(f"#/jobs/{SEQUENCE}")
    page.wait("[...document.querySelectorAll('button')].some(b => b.innerText === 'Render again …')")
    page.evaluate("[...document.querySelectorAll('button')].find(b => b.innerText === 'Render again …').click()")
    assert "with all its frames" in page.text(".again .help")
    page.click(".again button[type=submit]")
    page.wait("location.hash === '#/jobs/j-again'")
    assert farm.submitted[0][0] == SEQUENCE


def test_a_sequence_is_one_job_in_the_list(farm, dashboard):
    sequence(farm, {1: "done", 2: "running", 3: "queued", 4: "queued"}, current=2)
    for frame in range(1, 5):
        listed = farm.jobs.pop(frame_id(frame))  # as the coordinator's list, which has no frames
    page = dashboard()
    page.wait("document.querySelector('[data-job]')")

    farm.emit("job", listed)  # of a frame
    farm.change(SEQUENCE, progress=0.5)

    page.wait("document.querySelector('[data-job]').innerText.includes('50 %')")
    assert page.count("[data-job]") == 1
    assert "1 of 4 frames" in page.text("[data-job]")


def test_frames_are_chosen_and_each_has_its_own_image(farm, dashboard):
    farm.images = {frame_id(1): png(64, 48, (200, 10, 10)), frame_id(2): png(64, 48, (10, 200, 10))}
    sequence(farm, {1: "done", 2: "running", 3: "queued", 4: "queued"}, current=2)
    page = dashboard(f"#/jobs/{SEQUENCE}")
    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    assert shown(page) == "2" and pixel(page) == [10, 200, 10]
    assert [page.evaluate(f"document.querySelector('[data-frame=\"{n}\"]').className") for n in (1, 3)] == ["frame is-done", "frame is-queued"]

    page.click("[data-frame='1']")

    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '1'")
    page.wait("document.querySelector('.stage live-image').dataset.painted")
    page.wait("document.querySelector('.stage live-image canvas').getContext('2d').getImageData(5, 5, 1, 1).data[0] === 200")
    assert page.evaluate("location.hash") == f"#/jobs/{SEQUENCE}/1"
    assert page.evaluate("document.querySelector('.downloads a').getAttribute('href')").endswith(f"/jobs/{frame_id(1)}/image.exr")
    page.click("[aria-label='The next frame']")
    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '2'")


def test_events_move_the_frames_and_the_page_follows_what_is_rendered(farm, dashboard):
    sequence(farm, {1: "running", 2: "queued", 3: "queued", 4: "queued"}, current=1)
    page = dashboard(f"#/jobs/{SEQUENCE}")
    page.wait("document.querySelector('.frame[aria-current]')?.dataset.frame === '1'")

    advance(farm, {1: "done", 2: "running", 3: "queued", 4: "queued"}, current=2, changed=(1, 2))

    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '2'")
    page.wait("document.querySelector('[data-frame=\"1\"]').className === 'frame is-done'")
    page.wait("document.querySelector('.frames-head').innerText.includes('1 of 4 done')")

    page.click("[data-frame='1']")
    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '1'")
    advance(farm, {1: "done", 2: "running", 3: "running", 4: "queued"}, current=3, changed=(3,))
    page.wait("document.querySelector('[data-frame=\"3\"]').className === 'frame is-running'")
    assert shown(page) == "1", "a frame that was chosen stays"
    page.click(".follow")
    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '3'")


def test_a_frame_has_a_page_of_its_own_address(farm, dashboard):
    sequence(farm, {1: "done", 2: "running", 3: "queued", 4: "queued"}, current=2)

    page = dashboard(f"#/jobs/{SEQUENCE}/1")

    page.wait("document.querySelector('.frame[aria-current]')?.dataset.frame === '1'")


def film(farm, dashboard):
    """A sequence of three done frames in colours of their own, and one that is rendered; its page shows frame 1."""
    farm.images = {frame_id(n): png(64, 48, (50 * n, 10, 10)) for n in range(1, 5)}
    sequence(farm, {1: "done", 2: "done", 3: "running", 4: "done"}, current=3)
    page = dashboard(f"#/jobs/{SEQUENCE}/1")
    page.wait("document.querySelector('.stage live-image')?.dataset.painted")
    return page


def film_red(page):
    """Red of the picture that the film shows over the image; null if it shows none."""
    return page.evaluate("(() => { const f = document.querySelector('.films frame-film'); return f && !f.hidden && f.dataset.whole === 'yes' ? f.firstChild.getContext('2d').getImageData(5, 5, 1, 1).data[0] : null; })()")


def wait_film(page, red):
    page.wait(f"(() => {{ const f = document.querySelector('.films frame-film'); return f && !f.hidden && f.dataset.whole === 'yes' && f.firstChild.getContext('2d').getImageData(5, 5, 1, 1).data[0] === {red}; }})()")


def scrub_to(page, index):
    page.evaluate(f"(() => {{ const s = document.getElementById('scrub'); s.value = '{index}'; s.dispatchEvent(new Event('input')); }})()")


def test_the_strip_has_small_pictures_of_frames_that_have_samples(farm, dashboard):
    page = film(farm, dashboard)
    page.wait("[...document.querySelectorAll('.frame img')].length === 4 && [...document.querySelectorAll('.frame img')].every((i) => i.complete && i.naturalWidth === 16)")


def test_the_slider_scrubs_through_the_frames_that_are_done(farm, dashboard):
    page = film(farm, dashboard)
    assert page.evaluate("document.getElementById('scrub').max") == "2"

    scrub_to(page, 2)

    wait_film(page, 200)
    assert shown(page) == "4"
    assert page.evaluate("getComputedStyle(document.querySelector('frame-film canvas')).backgroundColor") == "rgb(5, 6, 8)", "a picture with alpha hides the one below"
    assert page.evaluate("document.getElementById('scrub').getAttribute('aria-valuetext')") == "Frame 4"
    assert page.evaluate("location.hash") == f"#/jobs/{SEQUENCE}/1", "the page stays at its frame until the slider is let go"
    page.evaluate("document.getElementById('scrub').dispatchEvent(new Event('change'))")
    page.wait(f"location.hash === '#/jobs/{SEQUENCE}/4'")
    page.wait("document.querySelector('.stage live-image').dataset.painted && !document.querySelector('.films')")
    assert pixel(page)[0] == 200


def record_pictures(page):
    """Keeps in `window.seen` which picture of the film is shown, in turn. A busy page may draw no frame while one is."""
    page.evaluate("""(() => {
      window.seen = [];
      new MutationObserver(() => window.seen.push(document.querySelector('frame-film').dataset.shown)).observe(document.querySelector('frame-film'), { attributeFilter: ['data-shown'] });
    })()""")


def test_the_keyboard_scrubs_plays_and_steps(farm, dashboard):
    page = film(farm, dashboard)
    page.evaluate("document.getElementById('scrub').focus()")
    page.key("ArrowRight", virtual=39)
    page.wait(f"location.hash === '#/jobs/{SEQUENCE}/2'")
    page.key("End", virtual=35)
    page.wait(f"location.hash === '#/jobs/{SEQUENCE}/4'")
    assert page.evaluate("document.activeElement.id") == "scrub"

    record_pictures(page)
    page.key(" ", "Space", 32)
    page.wait("document.querySelector('.play').innerText === 'Pause'")
    page.wait("['frame1', 'frame2', 'frame4'].every((frame) => window.seen.some((one) => one.endsWith(frame)))")  # it goes round
    page.key(" ", "Space", 32)
    page.wait("document.querySelector('.play').innerText === 'Play' && !document.querySelector('.films')")
    at = page.evaluate("location.hash").split("/")[-1]
    assert at in ("1", "2", "4") and shown(page) == at

    page.wait("!!document.querySelector('[data-frame=\"2\"]')")
    page.evaluate("document.querySelector('[data-frame=\"2\"]').focus()")
    page.evaluate(f"void (location.hash = '#/jobs/{SEQUENCE}/2')")
    page.wait("document.querySelector('.frame[aria-current]').dataset.frame === '2'")
    page.key("ArrowRight", virtual=39)  # the strip has all frames
    page.wait(f"location.hash === '#/jobs/{SEQUENCE}/3'")


def test_playing_goes_on_if_it_is_started_before_the_event_of_the_new_address(farm, dashboard):
    page = film(farm, dashboard)
    record_pictures(page)

    page.evaluate("""(() => {
      const scrub = document.getElementById('scrub');
      scrub.value = '2';
      for (const event of ['input', 'change']) scrub.dispatchEvent(new Event(event));
      document.querySelector('.play').click();
    })()""")

    page.wait("['frame1', 'frame2'].every((frame) => window.seen.some((one) => one.endsWith(frame)))")
    assert page.evaluate("document.querySelector('.play').innerText") == "Pause"


def test_playing_waits_for_pictures_and_never_skips_one(farm, dashboard):
    page = film(farm, dashboard)
    record_pictures(page)
    page.evaluate("(() => { const s = document.querySelector('.player select'); s.value = '60'; s.dispatchEvent(new Event('change')); })()")
    page.click(".play")
    page.wait("window.seen.length > 8")
    page.click(".play")
    seen = [int(one.rsplit("frame", 1)[1]) for one in page.evaluate("window.seen")]
    order = [frame for i, frame in enumerate(seen) if i == 0 or frame != seen[i - 1]]  # the small picture and the whole one
    following = {1: 2, 2: 4, 4: 1}
    assert all(b == following[a] for a, b in zip(order, order[1:])), order


def test_a_video_is_made_on_request_and_says_how_far_it_is(farm, dashboard):
    page = film(farm, dashboard)
    page.evaluate("(() => { const s = document.querySelector('.player select'); s.value = '30'; s.dispatchEvent(new Event('change')); })()")
    page.click(".video button")
    page.wait("document.querySelector('.video').innerText.includes('waits')")
    assert farm.submitted == [(SEQUENCE, {"exposure": 0, "fps": 30, "view": "sRGB"})]
    assert page.evaluate("document.querySelector('.video button').disabled")

    farm.video = {**farm.video, "state": "making", "frames_done": 2}
    page.wait("document.querySelector('.video').innerText.includes('2 of 3 frames')")
    farm.video = {**farm.video, "state": "ready", "frames_done": 3, "bytes": 3 << 20}
    page.wait("document.querySelector('.video a')")

    assert page.text(".video a") == "Video, 3.0 MiB"
    assert page.evaluate("document.querySelector('.video a').getAttribute('href')") == f"/api/v1/jobs/{SEQUENCE}/video.mp4"
    assert "30 per second" in page.text(".video")


def test_a_farm_without_ffmpeg_says_so(farm, dashboard):
    farm.no_video = "the coordinator's machine has no ffmpeg, which makes videos: install it there (apt-get install ffmpeg), then ask again"
    page = film(farm, dashboard)
    page.click(".video button")
    page.wait("document.querySelector('.video').innerText.includes('apt-get install ffmpeg')")


def test_who_may_only_read_sees_a_video_but_makes_none(farm, dashboard):
    farm.role = "read"
    farm.video = {**farm.video, "state": "ready", "frames": 3, "fps": 24, "bytes": 1000}
    page = film(farm, dashboard)
    page.wait("document.querySelector('.video a')")
    assert page.count(".video button") == 0


def test_the_files_of_all_frames_are_taken_along_and_the_range_is_sent(farm, dashboard, tmp_path):
    scene = '<scene version="3.0.0"><volume><string name="filename" value="smoke/fog.####.vdb"/></volume></scene>'
    files = {"smoke.xml": scene, "fog.0001.vdb": "1", "fog.0002.vdb": "2", "fog.12.vdb": "no frame", "other.vdb": "none"}
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    page = dashboard("#/submit")
    page.wait("document.getElementById('files')")
    page.set_files("#files", [tmp_path / name for name in files])
    # The list of files moves the form down when the scene has been read
    page.wait("document.querySelector('.settings button:not([disabled])')")
    page.click("#set-frames")
    page.type("1-two")
    page.click(".settings button")
    assert "Frames must be first-last" in page.text(".notice")

    page.evaluate("document.getElementById('set-frames').select()")
    page.type("1-2")
    page.click(".settings button")

    page.wait("location.hash === '#/jobs/j-new'")
    assert sorted(farm.submitted[0]["assets"]) == ["smoke/fog.0001.vdb", "smoke/fog.0002.vdb"]
    assert farm.submitted[0]["spec"] == {"frames": "1-2"}


HEAVY = {"kind": "heavy_tail", "trusted": False, "advice": "render it with four times the samples."}


def noisy_frame(farm, dashboard):
    """The page of a sequence, whose first frame is chosen and noisy."""
    sequence(farm, {1: "done", 2: "done"}, 2)
    farm.jobs[frame_id(1)] = frame_job(1, "done", spp=64, spp_asked=64, spp_done=64, verdict=HEAVY)
    page = dashboard(f"#/jobs/{SEQUENCE}")
    page.wait("document.querySelector('.frame[data-frame=\"1\"]')")
    page.click('.frame[data-frame="1"]')
    page.wait("document.querySelector('.frame-on')?.innerText.includes('Frame 1: Done')")
    return page


def test_a_noisy_frame_says_what_to_do_and_goes_on_by_itself(farm, dashboard):
    page = noisy_frame(farm, dashboard)
    assert "Render it with four times the samples." in page.text(".frame-on .noisy")

    page.click(".frame-on button")

    wait_until(lambda: farm.changes, "the farm is asked")
    assert farm.changes == [(frame_id(1), {"spp": 256})]


def test_a_frame_offers_nothing_to_those_who_may_only_look(farm, dashboard):
    farm.role = "read"
    page = noisy_frame(farm, dashboard)
    assert page.evaluate("document.querySelectorAll('.frame-on button').length") == 0
