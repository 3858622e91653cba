"""Files that were opened or saved lately."""

from darko_gcs.tui.plan_draft import MAX_FILES, RecentFiles


def made(folder, name):
    path = folder / name
    path.touch()
    return str(path)


def test_the_newest_comes_first_and_once_and_is_known_the_next_time(tmp_path):
    a, b = made(tmp_path, "a.plan"), made(tmp_path, "b.plan")
    recent = RecentFiles(tmp_path / "state" / "recent-plans")
    for path in (a, b, a):
        recent.add(path)
    assert recent.paths == RecentFiles(tmp_path / "state" / "recent-plans").paths == (a, b)


def test_files_that_are_gone_are_left_out(tmp_path):
    recent = RecentFiles()
    recent.add(made(tmp_path, "a.plan"))
    (tmp_path / "a.plan").unlink()
    assert recent.paths == ()


def test_only_so_many_are_kept(tmp_path):
    recent = RecentFiles()
    for number in range(MAX_FILES + 5):
        recent.add(made(tmp_path, f"{number}.plan"))
    assert len(recent.paths) == MAX_FILES


def test_a_file_that_cannot_be_read_or_written_is_no_failure(tmp_path):
    (tmp_path / "recent-plans").write_bytes(b"\xff\xfe")
    recent = RecentFiles(tmp_path / "recent-plans")
    assert recent.paths == ()
    in_the_way = RecentFiles(tmp_path / "recent-plans" / "below")
    in_the_way.add(made(tmp_path, "a.plan"))
    assert in_the_way.paths == (str(tmp_path / "a.plan"),)
