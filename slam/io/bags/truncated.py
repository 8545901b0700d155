"""Recordings whose end, and with it the index, is missing after a crash or on a full disk: they are
read from the beginning up to the first damaged record."""

from __future__ import annotations

import os
import struct
from collections import defaultdict
from contextlib import suppress
from io import BytesIO

from rosbags.rosbag1.reader import (
    Chunk,
    ChunkInfo,
    Header,
    IndexData,
    ReaderError,
    RecordType,
    decompressors,
    read_bytes,
    read_uint32,
)

from slam.errors import InputError
from slam.io.bags.safe_readers import Bag1, Mcap

FOOTER, END_OF_DATA = 0x02, 0x0F  # types of MCAP records


class TruncatedBag1(Bag1):
    """A ROS 1 bag without its index, which is rebuilt from the chunks."""

    def open(self) -> None:
        """Read all records."""
        self.bio = self.path.open("rb")
        self.bio.readline()
        Header.read(self.bio, RecordType.BAGHEADER)
        self.bio.seek(read_uint32(self.bio), os.SEEK_CUR)
        found: dict[int, list[IndexData]] = defaultdict(list)
        try:
            while self._take_record(found):
                pass
        except InputError:
            raise
        except Exception:  # the first damaged record
            pass
        self.connections = [one._replace(msgcount=len(found[one.id])) for one in self.connections]
        self.indexes = {one.id: sorted(found[one.id]) for one in self.connections}

    def _take_record(self, found: dict[int, list[IndexData]]) -> bool:
        """Read one record; False if it was the last."""
        assert self.bio
        at = self.bio.tell()
        header = Header.read(self.bio)
        size = read_uint32(self.bio)
        start = self.bio.tell()
        left = self.path.stat().st_size - start
        if header.get_uint8("op") == RecordType.CHUNK:
            packing = header.get_string("compression")
            if (
                packing == "none" and not 0 < size <= left
            ):  # the size is written when the chunk is complete
                size = left
            unpack = decompressors[packing]
            self.chunks[at] = Chunk(size, start, unpack)
            with BytesIO(unpack(read_bytes(self.bio, size))) as chunk:
                self._take_chunk(at, chunk, found)
        self.bio.seek(start + size)
        return size < left

    def _take_chunk(self, at: int, chunk: BytesIO, found: dict[int, list[IndexData]]) -> None:
        whole, end = self.bio, len(chunk.getbuffer())
        times = []
        with suppress(ReaderError):  # the truncated end
            while (offset := chunk.tell()) < end:
                header = Header.read(chunk)
                if header.get_uint8("op") == RecordType.CONNECTION:
                    chunk.seek(offset)
                    self.bio = chunk
                    try:
                        one = self.read_connection()
                    finally:
                        self.bio = whole
                    if all(one.id != known.id for known in self.connections):
                        self.connections.append(one)
                    continue
                read_bytes(chunk, read_uint32(chunk))
                if header.get_uint8("op") == RecordType.MSGDATA:
                    times.append(header.get_time("time"))
                    entry = IndexData(times[-1], at, offset)
                    found[header.get_uint32("conn")].append(entry)
        if times:
            self.chunk_infos.append(ChunkInfo(at, min(times), max(times) + 1, {}))


class TruncatedMcap(Mcap):
    """An MCAP file without its end, read up to the last complete record."""

    def _open(self) -> None:
        assert self.bio
        size = self.path.stat().st_size
        self.data_start = self.data_end = self.bio.seek(8)  # after the magic
        while len(head := self.bio.read(9)) == 9:
            kind, length = struct.unpack("<BQ", head)
            end = self.bio.tell() + length
            if kind in (FOOTER, END_OF_DATA) or end > size:
                break
            self.data_end = self.bio.seek(end)
        self.meta_scan()
        assert self.statistics
        statistics = self.statistics
        if not statistics.message_count:
            raise InputError("no message in it")
        counts = statistics.channel_message_counts
        self.connections = [
            one._replace(msgcount=counts.get(one.id, 0)) for one in self.connections
        ]
        self.metadata = self.metadata._replace(
            duration=statistics.end_time - statistics.start_time,
            message_count=statistics.message_count,
            start_time=statistics.start_time, end_time=statistics.end_time,
        )  # fmt: skip
