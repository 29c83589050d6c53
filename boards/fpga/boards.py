"""Lists all boards by their names."""

from tachometry.boards.fpga.arty_a7_35 import ARTY_A7_35
from tachometry.boards.fpga.board import Board
from tachometry.boards.fpga.de10_nano import DE10_NANO
from tachometry.boards.fpga.icebreaker import ICEBREAKER
from tachometry.boards.fpga.tang_nano_9k import TANG_NANO_9K
from tachometry.boards.fpga.ulx3s import ULX3S

BOARDS: dict[str, Board] = {board.name: board for board in (TANG_NANO_9K, ICEBREAKER, *ULX3S, ARTY_A7_35, DE10_NANO)}
