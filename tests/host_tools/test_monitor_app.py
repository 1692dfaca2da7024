"""The full screen under textual's pilot: what it shows and what its keys do."""

import asyncio

from host_tools.monitor_app import MonitorApp
from host_tools.monitor_session import MonitorSession
from tests.host_tools.tap_story import Story
from tests.host_tools.test_monitor_session import Cable


def screen_text(app):
    return "\n".join(str(app.query_one(name).render()) for name in ("#map", "#rows", "#status"))


def play(script, size=(120, 45)):
    async def main():
        cable = Cable()
        app = MonitorApp(MonitorSession(cable), rate_hz=20)
        async with app.run_test(size=size) as pilot:
            await script(app, pilot, cable)
        return app
    return asyncio.run(main())


async def until(pilot, true, patience=200):
    for _ in range(patience):
        if true():
            return
        await pilot.pause(0.02)
    raise AssertionError("waited in vain")


def test_the_screen_follows_the_mission_and_q_leaves():
    async def script(app, pilot, cable):
        story = Story()
        await until(pilot, lambda: "nothing heard from the core yet" in screen_text(app))
        cable.pieces += [story.hello()] + [story.frames(step) for step in range(0, 1501, 5)]
        await until(pilot, lambda: "30.0 s, step 1,500" in screen_text(app))
        text = screen_text(app)
        for part in ("FOLLOW", "heading 180.0°", "vectors", "/768", "61,234 of 196,608 B", "I6", "bad frames", "←"):
            assert part in text, part
        await pilot.press("q")
    app = play(script)
    assert app.end is None and app.return_code == 0


def test_m_zooms_and_p_holds_the_picture_while_data_is_still_taken():
    async def script(app, pilot, cable):
        story = Story()
        cable.pieces += [story.frames(step) for step in range(0, 501, 5)]
        await until(pilot, lambda: "step 500" in screen_text(app))
        await pilot.press("m")
        assert "zoom x2" in screen_text(app)
        await pilot.press("p")
        assert "PAUSED" in screen_text(app)
        cable.pieces += [story.frames(step) for step in range(505, 1001, 5)]
        await until(pilot, lambda: app.session.state.steps == 1000)
        await pilot.pause(0.15)
        assert "step 500" in screen_text(app)
        await pilot.press("p")
        assert "step 1,000" in screen_text(app) and "PAUSED" not in screen_text(app)
    play(script)


def test_s_gives_a_narrow_terminal_to_the_map():
    async def script(app, pilot, cable):
        story = Story()
        cable.pieces += [story.frames(step) for step in range(0, 501, 5)]
        await until(pilot, lambda: "step 500" in screen_text(app))
        narrow = app.query_one("#map").size.width
        await pilot.press("s")
        await until(pilot, lambda: app.query_one("#map").size.width == 80)
        await pilot.press("s")
        await until(pilot, lambda: app.query_one("#map").size.width == narrow < 40)
    play(script, size=(80, 24))


def test_arrows_bring_the_last_rows_into_a_low_terminal():
    async def script(app, pilot, cable):
        cable.pieces += [Story().frames(step) for step in range(0, 501, 5)]
        await until(pilot, lambda: "step 500" in screen_text(app))
        side = app.query_one("#side")
        await until(pilot, lambda: side.max_scroll_y > 15)
        await pilot.press("down")
        await until(pilot, lambda: side.scroll_y == 3)
        await pilot.press("pagedown", "pagedown", "pagedown", "pagedown")
        await until(pilot, lambda: side.scroll_y == side.max_scroll_y)
        await pilot.press("up")
        await until(pilot, lambda: side.scroll_y == side.max_scroll_y - 3)
    play(script, size=(80, 24))


def test_a_closed_port_ends_the_screen_with_its_sentence():
    async def script(app, pilot, cable):
        cable.pieces.append(Story().frames(50))
        await until(pilot, lambda: app.session.state.steps == 50)
        cable.open = False
        await until(pilot, lambda: app.end is not None)
    app = play(script)
    assert app.end.code == 3 and "was closed by its other end" in app.end.sentence


def test_a_finished_mission_stays_to_be_looked_at():
    async def script(app, pilot, cable):
        story = Story()
        cable.pieces += [story.frames(story.last_step), story.frames(story.last_step + 1)]
        cable.open = False
        await until(pilot, lambda: "The mission ended: DONE" in screen_text(app))
        await pilot.pause(0.1)
        assert app.is_running and "Press q" in screen_text(app)
        await pilot.press("q")
    app = play(script)
    assert app.end.code == 0


def test_a_small_terminal_is_no_error():
    async def script(app, pilot, cable):
        cable.pieces.append(Story().frames(50))
        await until(pilot, lambda: app.session.state.steps == 50)
        await pilot.pause(0.1)
    play(script, size=(20, 5))
