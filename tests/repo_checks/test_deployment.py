"""Deployment files: the compose file and the systemd unit."""

import configparser
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

from kata.device import config
from kata.settings import by_tls
from tests.support.paths import ROOT


def compose(name: str = "docker-compose.yml") -> Any:
    return yaml.safe_load((ROOT / name).read_text())


def test_every_container_has_no_privileges_and_few_writable_paths() -> None:
    services = compose()["services"]
    assert set(services) == {"database", "station-1", "station-2", "proxy"}
    for name, service in services.items():
        uid = int(service["user"].partition(":")[0])
        assert uid > 0, name
        assert service["read_only"] is True, name
        assert service["cap_drop"] == ["ALL"], name
        assert service["security_opt"] == ["no-new-privileges:true"], name
        assert service["healthcheck"]["test"], name
        assert not service.get("privileged"), name


def test_each_station_has_its_name_volume_and_real_time() -> None:
    composed = compose()
    stations = {name: service for name, service in composed["services"].items() if name.startswith("station-")}
    names = set()
    for name, service in stations.items():
        mounts = dict(mount.split(":")[:2] for mount in service["volumes"])
        assert mounts[name] == "/var/lib/kata"
        assert name in composed["volumes"]
        file = next(
            Path(source) for source, target in mounts.items() if target == service["environment"]["KATA_STATION"]
        )
        names.add(config.read(ROOT / file).name)
        assert service["ulimits"] == {"rtprio": 70, "memlock": -1}
        assert service["depends_on"] == {"database": {"condition": "service_healthy"}}
        assert "/health/live" in service["healthcheck"]["test"][-1], "a station without its database stays healthy"
        assert f"https://{name}." in (ROOT / "deploy/proxy/Caddyfile").read_text()
    assert len(names) == len(stations)


def test_only_the_proxy_is_reachable_and_reaches_no_database() -> None:
    services = compose()["services"]
    assert [name for name, service in services.items() if "ports" in service] == ["proxy"]
    assert services["database"]["network_mode"] == "none"
    assert "listen_addresses=" in services["database"]["command"]
    with_socket = {name for name, service in services.items() if "database-socket" in str(service["volumes"])}
    assert with_socket == {"database", "station-1", "station-2"}
    url = services["station-1"]["environment"]["KATA_DATABASE_URL"].replace("${", "").replace("}", "")
    assert by_tls(url) == url, "by a socket on this computer"
    assert "@/kata?host=/run/postgresql" in url
    address = services["proxy"]["networks"]["pages"]["ipv4_address"]
    assert services["station-1"]["environment"]["KATA_TRUSTED_PROXIES"] == address


def test_logs_go_to_the_clinics_server_over_tls() -> None:
    with_logs, services = compose("deploy/logs.yml")["services"], compose()["services"]
    assert set(with_logs) == set(services)
    for name, service in with_logs.items():
        options = service["logging"]["options"]
        assert options["syslog-address"].startswith("tcp+tls://"), name
        assert options["syslog-tls-ca-cert"], name
        assert "syslog-tls-skip-verify" not in options, name
        assert options["mode"] == "non-blocking", f"{name} does not wait for a log server"
    for station in ("station-1", "station-2"):
        assert services[station]["environment"]["KATA_LOG_FORMAT"] == "json", "with the rows of the audit trail"


def test_stations_open_each_others_secrets() -> None:
    services = compose()["services"]
    for station in ("station-1", "station-2"):
        key = Path(services[station]["environment"]["KATA_SECOND_FACTOR_KEY"])
        assert f"shared:{key.parent}" in services[station]["volumes"]
    assert "/var/lib/kata-shared" in (ROOT / "Dockerfile").read_text()


def test_compose_file_contains_no_secret() -> None:
    text = (ROOT / "docker-compose.yml").read_text()
    assert re.findall(r"PASSWORD: (?!\$\{)", text) == []


def test_an_adapter_is_passed_through() -> None:
    service = compose("deploy/rs485.yml")["services"]["station-1"]
    assert [device.rpartition(":")[2] for device in service["devices"]] == ["/dev/rs485"]
    assert config.read(ROOT / "deploy/stations/station-1.toml").port == "/dev/rs485"
    assert service["environment"]["KATA_SIMULATE"] == "false"


def dockerfile() -> list[tuple[str, str]]:
    """Return instructions and arguments of the Dockerfile."""
    text = re.sub(r"^#.*\n", "", (ROOT / "Dockerfile").read_text(), flags=re.MULTILINE)
    lines = text.replace("\\\n", " ").splitlines()
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in lines if line.strip())]


def test_the_image_runs_without_privileges_on_its_port() -> None:
    last = dockerfile()[max(n for n, (word, _) in enumerate(dockerfile()) if word == "FROM") :]
    found = dict(last)
    assert found["USER"] == "kata"
    run = next(rest for word, rest in last if word == "RUN")
    uid = re.search(r"useradd --system --uid (\d+)", run)
    assert uid
    users = {service["user"] for name, service in compose()["services"].items() if name.startswith("station-")}
    assert users == {f"{uid[1]}:{uid[1]}"}
    assert f"KATA_PORT={found['EXPOSE']}" in found["ENV"]
    assert f"https://127.0.0.1:{found['EXPOSE']}/health/live" in found["HEALTHCHECK"]
    assert found["VOLUME"] in run
    assert (found["ENTRYPOINT"], found["CMD"], found["STOPSIGNAL"]) == ('["kata"]', '["serve"]', "SIGINT")


def test_the_image_has_one_python_and_every_pinned_package() -> None:
    bases = {rest.split()[0] for word, rest in dockerfile() if word == "FROM"}
    assert len(bases) == 1
    build = next(rest for word, rest in dockerfile() if word == "RUN")
    assert "--require-hashes" in build
    assert (ROOT / re.findall(r"--requirement (\S+)", build)[0]).is_file()


def test_the_image_gets_every_file_of_a_wheel() -> None:
    first, *rules = (ROOT / ".dockerignore").read_text().split()
    assert first == "*"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    needed = {*project["tool"]["hatch"]["build"]["targets"]["sdist"]["include"], "pyproject.toml"}
    assert needed <= {rule.removeprefix("!") for rule in rules if rule.startswith("!")}


def test_every_mounted_file_of_the_compose_files_exists() -> None:
    for name in ("docker-compose.yml", "deploy/rs485.yml"):
        for service in compose(name)["services"].values():
            for mount in service.get("volumes", ()):
                source = mount.partition(":")[0]
                assert not source.startswith("./") or (ROOT / source).is_file(), mount


def test_ports_of_the_proxy_and_the_stations_agree() -> None:
    services = compose()["services"]
    caddyfile = (ROOT / "deploy/proxy/Caddyfile").read_text()
    (published,) = services["proxy"]["ports"]
    assert f"https_port {published.partition(':')[2]}" in caddyfile
    port = dict(dockerfile())["EXPOSE"]
    assert f"reverse_proxy {{args[0]}}:{port}" in caddyfile
    for station in ("station-1", "station-2"):
        assert f"import station {station}\n" in caddyfile
        assert f"http://127.0.0.1:{port}/health/live" in services[station]["healthcheck"]["test"][-1]


def test_the_package_refers_to_the_unit_and_its_paths() -> None:
    unit = (ROOT / "deploy/systemd/kata.service").read_text()
    postinst = (ROOT / "deploy/debian/postinst").read_text()
    assert "ExecStart=/opt/kata/current/bin/kata serve" in unit
    assert "EnvironmentFile=-/etc/kata/environment" in unit
    assert "root=/opt/kata" in postinst
    (station_file,) = re.findall("KATA_STATION=(.*)", unit)
    assert f"[ -e {station_file} ]; then" in postinst
    assert station_file.startswith("/var/lib/kata/"), "a commissioning on the page writes it"
    assert "StateDirectory=kata\n" in unit
    assert "ProtectSystem=strict" in unit


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("Type", "notify"), ("WatchdogSec", "20"), ("Restart", "always"), ("User", "kata"), ("LimitRTPRIO", "70"),
        ("LimitMEMLOCK", "infinity"), ("NoNewPrivileges", "yes"), ("ProtectSystem", "strict"), ("KillSignal", "SIGINT"),
    ],
)  # fmt: skip
def test_unit_has_a_watchdog_real_time_and_no_other_privileges(key: str, value: str) -> None:
    unit = configparser.ConfigParser(strict=False, interpolation=None)
    unit.optionxform = str  # type: ignore[assignment,method-assign]
    unit.read(ROOT / "deploy/systemd/kata.service")
    assert unit["Service"][key] == value
