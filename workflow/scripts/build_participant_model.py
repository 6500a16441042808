"""Rule build_participant_model: scale the model to a participant. Runs opensim."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.model.choices import read_choices
from scapulohumeral.model.opensim_model import model_record, participant_model, write_osim
from scapulohumeral.model.participant import participant_of
from scapulohumeral.model.record import write_record
from scapulohumeral.model.tables import read_tables

tables = read_tables(Path(snakemake.input.tables[0]).parent)
participant = participant_of(Path(snakemake.input.participant))
choices = read_choices(snakemake.params.choices)

model = participant_model(tables, participant, choices)
record = model_record(model, participant, tables, choices)
write_record(record, Path(snakemake.output.model))
write_osim(model, Path(snakemake.output.osim))
