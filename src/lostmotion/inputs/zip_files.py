"""Resources that a ZIP archive requires of its reader, checked before any file is decompressed."""

import zipfile

from ..errors import InputError
from .memory_limits import check_memory

METHODS = {zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED}  # the others are decompressed without a limit by the library
ENCRYPTED = 1  # flag of a member
MOST = 10_000  # members


def members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """Members of an open archive by name, if all of them fit into memory; each is read up to the size that it announces."""
    found = archive.infolist()
    if len(found) > MOST:
        raise InputError(f"has {len(found)} members; {MOST} at most are read, leave out those that are no data")
    check_memory(float(sum(member.file_size for member in found)))
    for member in found:
        if member.flag_bits & ENCRYPTED:
            raise InputError(f"{member.filename}: is encrypted; save the file without a password")
        if member.compress_type not in METHODS:
            raise InputError(f"{member.filename}: is compressed by a method other than deflate; save it with deflate")
    if len({member.filename for member in found}) < len(found):
        raise InputError("has two members of one name; save it again")
    return {member.filename: member for member in found}
