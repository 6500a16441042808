"""Where the trials of cases of known cause lie, and what they are made from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scapulohumeral.configuration.check import read_simulator
from scapulohumeral.configuration.real_cases import (
    Converted,
    Measured,
    RealCase,
    RealCases,
    Simulated,
)
from scapulohumeral.errors import ConfigError

NOWHERE = "none"


@dataclass(frozen=True)
class RealTrials:
    """Files of the cases.

    Attributes
    ----------
    cases : what there is; file : where that stands
    recordings : folder of the recordings, or "none"
    made : folder of the trials that are made from them
    """

    cases: RealCases
    file: Path
    recordings: str
    made: Path

    def recorded(self, person: str) -> Path:
        """Folder of the recordings of a person.

        Raises
        ------
        ConfigError                  it is not there
        """
        people: dict[str, Converted | Measured] = {**self.cases.converted, **self.cases.measured}
        name = people[person].folder
        folder = Path(self.recordings) / name
        if self.recordings == NOWHERE or not folder.is_dir():
            raise ConfigError(
                f"recordings: '{self.recordings}'; expected a folder with {name}, which no checkout"
                f" holds (source: {self.file}). Write --config recordings=FOLDER, or make real "
                "RECORDINGS=FOLDER."
            )
        return folder

    def markers(self, person: str) -> dict[str, list[str] | str]:
        """Recordings of markers of a person, and their map, by name of the input of a rule."""
        about = self.cases.converted[person]
        files = _files(self.recorded(person), about.files)
        return {"recordings": files, "map": about.map}

    def with_emg(self, person: str) -> dict[str, list[str] | str]:
        """Recordings of a person and the table of their EMG, by name of the input of a rule."""
        own = [case for case in self.cases.cases.values() if case.person == person]
        files = {file for case in own for file in self._recordings(case)}
        return {"trials": sorted(files), "emg": self._emg(person)}

    def participant(self, person: str) -> str:
        """Participant file of a person."""
        if person in self.cases.converted:
            return str(self.made / person / "participant.yaml")
        people: dict[str, Measured | Simulated] = {**self.cases.measured, **self.cases.simulated}
        return people[person].participant

    def inputs(self, case: str) -> dict[str, list[str] | str]:
        """What a case is diagnosed from, by name of the input of a rule.

        Raises
        ------
        ConfigError                  no recording fits a pattern
        """
        about, found = self.cases.cases[case], self.sources(case)
        if about.spoilt is not None:
            found["spoilt"] = str(self._spoilt(case))
        if about.simulator is not None:
            files = read_simulator(Path(about.simulator)).files
            found["simulator"] = [about.simulator, *map(str, files)]
        return found

    def sources(self, case: str) -> dict[str, list[str] | str]:
        """The same before any error of measurement is put in.

        Raises
        ------
        ConfigError                  no recording fits a pattern
        """
        about = self.cases.cases[case]
        inputs: dict[str, list[str] | str] = {"participant": self.participant(about.person)}
        if self._emg(about.person):
            inputs["trials"] = str(self._trials(about.person))
        elif about.person in self.cases.measured:
            inputs["trials"] = self._recordings(about)
        elif about.person in self.cases.simulated:
            folder = self.made / about.person
            patterns = (*about.test, *about.reference)
            motions = dict.fromkeys(Path(pattern).parts[0] for pattern in patterns)
            inputs["trials"] = [str(folder / motion) for motion in motions]
        return inputs

    def patterns(self, case: str) -> dict[str, list[str]]:
        """Files of both sides of a case as patterns for the shell: "test" and "reference"."""
        about = self.cases.cases[case]
        tests = self.unspoilt(case)
        if about.spoilt is not None:
            tests = [str(self._spoilt(case) / name) for name in about.test]
        folder = self._trials(about.person)
        return {"test": tests, "reference": [str(folder / name) for name in about.reference]}

    def unspoilt(self, case: str) -> list[str]:
        """Patterns of the test trials of a case before any error of measurement is put in."""
        about = self.cases.cases[case]
        return [str(self._trials(about.person) / name) for name in about.test]

    def _recordings(self, case: RealCase) -> list[str]:
        """Recordings of both sides of a case of a person whose joint angles were measured."""
        folder = self.recorded(case.person)
        patterns = (*case.test, *case.reference)
        return [file for pattern in patterns for file in _files(folder, pattern)]

    def _spoilt(self, case: str) -> Path:
        """Folder of the test trials of a case with an error of measurement."""
        return self.made / "spoilt" / case

    def _trials(self, person: str) -> Path:
        """Folder of the trials of a person, recorded or made."""
        if self._emg(person):
            return self.made / person / "with_emg"
        measured = person in self.cases.measured
        return self.recorded(person) if measured else self.made / person

    def _emg(self, person: str) -> str:
        """Table of the EMG of a person; empty without one."""
        return (person in self.cases.measured and self.cases.measured[person].emg) or ""


def _files(folder: Path, pattern: str) -> list[str]:
    found = sorted(str(path) for path in folder.glob(pattern))
    if not found:
        raise ConfigError(
            f"{folder}: no file {pattern}. Name the folder of recordings as it was published."
        )
    return found
