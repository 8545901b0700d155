"""Recordings whose end is missing, as a crash or a full disk leaves them: they have no index, and
are gone through from their beginning up to where they break."""

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
from slam.io.bags.guarded import Bag1, Mcap

FOOTER, END_OF_DATA = 0x02, 0x0F  # records of MCAP


class CutBag1(Bag1):
    """A ROS 1 bag, its index made by going through the chunks."""

    def open(self) -> None:
        """Go through the file."""
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
        except Exception:  # here it breaks
            pass
        self.connections = [one._replace(msgcount=len(found[one.id])) for one in self.connections]
        self.indexes = {one.id: sorted(found[one.id]) for one in self.connections}

    def _take_record(self, found: dict[int, list[IndexData]]) -> bool:
        """False where it was the last."""
        assert self.bio
        at = self.bio.tell()
        header = Header.read(self.bio)
        size = read_uint32(self.bio)
        start = self.bio.tell()
        left = self.path.stat().st_size - start
        if header.get_uint8("op") == RecordType.CHUNK:
            packing = header.get_string("compression")
            if packing == "none" and not 0 < size <= left:  # its size is written when it is whole
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
        with suppress(ReaderError):  # where it is cut off
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


class CutMcap(Mcap):
    """An MCAP file without its last part, read up to the last record that is whole."""

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
        told = self.statistics
        if not told.message_count:
            raise InputError("no message in it")
        counts = told.channel_message_counts
        self.connections = [
            one._replace(msgcount=counts.get(one.id, 0)) for one in self.connections
        ]
        self.metadata = self.metadata._replace(
            duration=told.end_time - told.start_time, message_count=told.message_count,
            start_time=told.start_time, end_time=told.end_time,
        )  # fmt: skip
