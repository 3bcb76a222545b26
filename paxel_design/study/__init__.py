"""What-if studies: a grid of prints and numbers of clusters, each calibrated on the virtual bench before it is printed.

`cases` says what is asked, `measuring` carries one case through the stages, `sharing` spares pictures that two cases
have in common, `running` runs cases side by side and keeps the folder of a study, and `figures` draws it (matplotlib,
not loaded here).
"""

from paxel_design.study.cases import Case, Study, cases_of
from paxel_design.study.measuring import measure_case
from paxel_design.study.running import run_study

__all__ = ["Case", "Study", "cases_of", "measure_case", "run_study"]
