"""Options, environment, and folders where clients may write."""

import pytest

from rapp_nao_sim.config import Config, read
from rapp_nao_sim.files import Files
from rapp_nao_sim.naoqi import NaoqiError


def test_without_words_the_defaults_hold():
    assert read([], {}) == Config()


def test_options_are_above_environment():
    assert read([], {"RAPP_NAO_PORT": "9000"}).port == 9000
    assert read(["--port", "0"], {"RAPP_NAO_PORT": "9000"}).port == 0


def test_every_option_reaches_the_settings(tmp_path):
    words = ["--address", "127.0.0.2", "--microphone", "text", "--voice", "silent", "--ambient", "200", "--no-world"]
    config = read([*words, "--files", str(tmp_path), "--files", "/tmp"], {})
    assert (config.address, config.microphone, config.voice, config.ambient) == ("127.0.0.2", "text", "silent", 200.0)
    assert [str(folder) for folder in config.files] == [str(tmp_path), "/tmp"]
    assert config.world is False
    config = read(["--room", "hall.toml", "--gui"], {})
    assert (str(config.room), config.gui, config.world) == ("hall.toml", True, True)


@pytest.mark.parametrize(
    ("words", "env"),
    [(["--port", "70000"], {}), (["--ambient", "-1"], {}), (["--voice", "loud"], {}), ([], {"RAPP_NAO_PORT": "many"})],
)
def test_a_wrong_setting_is_an_error_of_one_line(words, env, capsys):
    with pytest.raises(SystemExit) as caught:
        read(words, env)
    assert caught.value.code == 2
    assert "nao_sim: error: argument" in capsys.readouterr().err


def test_clients_write_in_their_folders_only(tmp_path):
    (tmp_path / "mine" / "sub").mkdir(parents=True)
    (tmp_path / "link").symlink_to("/etc")
    files = Files([tmp_path / "mine", tmp_path / "link2"])
    assert files.writable(str(tmp_path / "mine" / "sub" / "a.ogg")) == tmp_path / "mine" / "sub" / "a.ogg"
    for name, reason in {
        "/koukou": "outside",
        str(tmp_path / "mine" / ".." / "a.ogg"): "outside",
        str(tmp_path / "link" / "a.ogg"): "outside",
        str(tmp_path / "mine" / "none" / "a.ogg"): "folder does not exist",
        str(tmp_path / "mine" / "sub"): "is a folder",
    }.items():
        with pytest.raises(NaoqiError, match=f"cannot write .*{reason}"):
            files.writable(name)
