"""Writes DICOM by pydicom, then lets DCMTK and GDCM rewrite it; dcm2niix, plastimatch and MRtrix make volumes of it."""

import pathlib
import re
import shutil
import subprocess

import numpy
import pydicom
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRBigEndian, ExplicitVRLittleEndian, ImplicitVRLittleEndian, generate_uid

import shapes

CT, ENHANCED = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1"
STUDY = "1.2.826.0.1.3680043.8.498.1"


def uid(*parts):
    return ".".join([STUDY, *map(str, parts)])


def blank(kind, instance, syntax):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = kind
    meta.MediaStorageSOPInstanceUID = instance
    meta.TransferSyntaxUID = syntax
    d = FileDataset(None, {}, file_meta=meta, preamble=b"\0" * 128)
    d.SOPClassUID, d.SOPInstanceUID = kind, instance
    d.is_little_endian = syntax != ExplicitVRBigEndian
    d.is_implicit_VR = syntax == ImplicitVRLittleEndian
    d.PatientName, d.PatientID, d.PatientBirthDate, d.PatientSex = "Corpus^Made", "corpus", "", ""
    d.StudyInstanceUID, d.StudyDate, d.StudyTime, d.StudyID, d.AccessionNumber = STUDY, "20260101", "120000", "1", ""
    d.ReferringPhysicianName, d.Modality, d.FrameOfReferenceUID = "", "CT", uid(9)
    d.SamplesPerPixel, d.PhotometricInterpretation = 1, "MONOCHROME2"
    d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = 16, 16, 15, 1
    d.RescaleIntercept, d.RescaleSlope = "0", "1"
    return d


def ct_slice(z, values, series=1, syntax=ExplicitVRLittleEndian, **changes):
    """One slice at z voxels; changes: attributes that differ."""
    d = blank(CT, uid(series, z + 1), syntax)
    d.SeriesInstanceUID, d.SeriesNumber, d.SeriesDescription = uid(series), str(series), f"series {series}"
    d.InstanceNumber = str(z + 1)
    d.ImageType = ["ORIGINAL", "PRIMARY", "AXIAL"]
    d.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    x, y, bottom = shapes.ORIGIN
    d.ImagePositionPatient = [x, y, bottom + 2.0 * z]
    d.PixelSpacing, d.SliceThickness = [1.5, 1.0], "2"
    d.Rows, d.Columns = values.shape
    for name, value in changes.items():
        setattr(d, name, value)
    order = "<" if d.is_little_endian else ">"
    d.PixelData = values.astype(f"{order}u1" if d.BitsAllocated == 8 else f"{order}i2").tobytes()
    return d


def save(d, name, **options):
    d.save_as(shapes.place("pydicom", name), write_like_original=options.pop("bare", False), **options)


def series(folder, which=range(16), number=1, values=None, **changes):
    voxels = shapes.volume() if values is None else values
    for z in which:
        save(ct_slice(z, voxels[z], number, **changes), f"{folder}/{(z * 7) % 16:02}.dcm")


def scout(folder, name="scout.dcm", number=1):
    d = ct_slice(90, numpy.full((32, 24), 50), number)
    d.ImageType = ["ORIGINAL", "PRIMARY", "LOCALIZER"]
    d.ImageOrientationPatient = [0, 1, 0, 0, 0, -1]
    save(d, f"{folder}/{name}")


def enhanced():
    """One file of 16 frames; positions stand in functional groups."""
    d = blank(ENHANCED, uid(5, 1), ExplicitVRLittleEndian)
    d.SeriesInstanceUID, d.SeriesNumber, d.InstanceNumber = uid(5), "5", "1"
    d.ImageType = ["ORIGINAL", "PRIMARY", "VOLUME", "NONE"]
    del d.RescaleIntercept, d.RescaleSlope
    voxels = shapes.volume()
    d.NumberOfFrames, d.Rows, d.Columns = voxels.shape
    shared, turn, measures, rescale = Dataset(), Dataset(), Dataset(), Dataset()
    turn.ImageOrientationPatient = [1, 0, 0, 0, 1, 0]
    measures.PixelSpacing, measures.SliceThickness = [1.5, 1.0], "2"
    rescale.RescaleIntercept, rescale.RescaleSlope, rescale.RescaleType = "-5", "2", "US"
    shared.PlaneOrientationSequence = Sequence([turn])
    shared.PixelMeasuresSequence = Sequence([measures])
    shared.PixelValueTransformationSequence = Sequence([rescale])
    d.SharedFunctionalGroupsSequence = Sequence([shared])
    frames = []
    order = [(z * 5) % 16 for z in range(16)]
    for z in order:
        frame, place = Dataset(), Dataset()
        place.ImagePositionPatient = [shapes.ORIGIN[0], shapes.ORIGIN[1], shapes.ORIGIN[2] + 2.0 * z]
        frame.PlanePositionSequence = Sequence([place])
        frames.append(frame)
    d.PerFrameFunctionalGroupsSequence = Sequence(frames)
    d.PixelData = voxels[order].astype("<i2").tobytes()
    save(d, "enhanced/frames.dcm")


def by_pydicom():
    shapes.note("pydicom", pydicom.__version__)
    series("plain")
    series("implicit", syntax=ImplicitVRLittleEndian)
    series("big_endian", syntax=ExplicitVRBigEndian)
    series("rescaled", RescaleSlope="2", RescaleIntercept="-5")
    series("unsigned", PixelRepresentation=0)
    series("stored_12_bits", PixelRepresentation=0, BitsStored=12, HighBit=11)
    series("bytes", PixelRepresentation=0, BitsAllocated=8, BitsStored=8, HighBit=7)
    series("inverted", PhotometricInterpretation="MONOCHROME1")
    series("gap", [z for z in range(16) if z not in (5, 6)])
    series("scout_inside")
    scout("scout_inside")
    series("copies")
    for z in (0, 4):
        d = ct_slice(z, shapes.volume()[z])
        d.SOPInstanceUID = d.file_meta.MediaStorageSOPInstanceUID = uid(1, 100 + z)
        save(d, f"copies/again{z}.dcm")
    series("two_series", number=1)
    for z in range(5):
        save(ct_slice(z, shapes.volume()[z], 2), f"two_series/other{z}.dcm")
    for z in range(16):
        d = ct_slice(z, shapes.volume()[z])
        save(d, f"no_extension/IM{z:04}")
    for z in range(16):
        d = ct_slice(z, shapes.volume()[z], syntax=ImplicitVRLittleEndian)
        d.file_meta, d.preamble = None, None
        save(d, f"no_preamble/{z:02}.dcm", bare=True)
    # Slices side by side: the volume's y is the patient's z.
    for y in range(20):
        d = ct_slice(y, shapes.volume()[::-1, y, :], 3)
        d.ImageOrientationPatient = [1, 0, 0, 0, 0, -1]
        d.PixelSpacing, d.SliceThickness = [2.0, 1.0], "1.5"
        d.ImagePositionPatient = [10.0, -20.0 + 1.5 * y, 60.0]
        save(d, f"coronal/{y:02}.dcm")
    enhanced()


def run(*command, **options):
    made = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if made.returncode:
        raise OSError(f"{command[0]} ended with {made.returncode}: {(made.stderr or made.stdout).strip()[-300:]}")
    return made.stdout + made.stderr


def version(command, pattern):
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    return re.search(pattern, made.stdout + made.stderr)[1]


def each(writer, folder, command, source="pydicom/plain"):
    """Runs a converter on each slice."""

    def convert():
        for path in sorted(pathlib.Path(source).iterdir()):
            run(*command, str(path), shapes.place(writer, f"{folder}/{path.name}"))

    shapes.attempt(f"{writer}/{folder}", convert)


def by_dcmtk():
    shapes.note("dcmtk", version(["dcmdump", "--version"], r"dcmdump v(\S+)"))
    each("dcmtk", "implicit", ["dcmconv", "+ti"])
    each("dcmtk", "big_endian", ["dcmconv", "+tb"])
    each("dcmtk", "deflated", ["dcmconv", "+td"])
    each("dcmtk", "rle", ["dcmcrle"])
    each("dcmtk", "jpeg_lossless", ["dcmcjpeg", "+e1"], "pydicom/unsigned")
    each("dcmtk", "jpeg_lossless_process_14", ["dcmcjpeg", "+el"], "pydicom/unsigned")
    each("dcmtk", "jpeg_baseline", ["dcmcjpeg", "+eb", "+q", "98"], "pydicom/bytes")
    each("dcmtk", "jpeg_ls", ["dcmcjpls", "+el"])
    each("dcmtk", "jpeg_ls_near", ["dcmcjpls", "+en", "+md", "1"], "pydicom/unsigned")

    def disc():
        for z, path in enumerate(sorted(pathlib.Path("pydicom/plain").iterdir())):
            shutil.copy(path, shapes.place("dcmtk", f"disc/DICOM/ST000001/SE{z // 8:06}/IM{z:06}"))
        run("dcmmkdir", "+r", "+I", "-Pgp", "+id", ".", "DICOM", cwd="dcmtk/disc")

    shapes.attempt("dcmtk/disc", disc)


def by_gdcm():
    shapes.note("gdcm", version(["gdcmconv", "--version"], r"gdcm (\S+)"))
    for name, flags in {
        "raw": ["--raw"],
        "jpeg_lossless": ["--jpeg"],
        "jpeg_2000": ["--j2k"],
        "jpeg_ls": ["--jpegls"],
        "rle": ["--rle"],
        "implicit": ["--implicit", "--raw"],
    }.items():
        each("gdcm", name, ["gdcmconv", *flags], "pydicom/unsigned" if "lossless" in name else "pydicom/plain")
    each("gdcm", "jpeg_2000_lossy", ["gdcmconv", "--j2k", "--lossy", "-q", "90"], "pydicom/unsigned")


def from_dicom():
    shutil.rmtree("dcm2niix", ignore_errors=True)  # dcm2niix adds a letter to names that exist already
    shapes.note("dcm2niix", version(["dcm2niix", "--version"], r"(v\d\S+)"))
    for name, flags in (("plain", ["-z", "n"]), ("gz", ["-z", "i"]), ("nrrd", ["-z", "n", "-e", "y"])):
        path = shapes.place("dcm2niix", f"{name}/volume")
        shapes.attempt(
            path, lambda: run("dcm2niix", *flags, "-f", "volume", "-o", f"dcm2niix/{name}", "pydicom/plain")
        )
    shapes.note("plastimatch", version(["plastimatch", "--version"], r"version (\S+)"))
    for name in ("volume.mha", "volume.nrrd", "volume.nii.gz", "volume.mhd"):
        path = shapes.place("plastimatch", name)
        shapes.attempt(path, lambda: run("plastimatch", "convert", "--input", "pydicom/plain", "--output-img", path))
    shapes.attempt(
        "plastimatch",
        lambda: run(
            "plastimatch",
            "convert",
            "--input",
            "pydicom/plain",
            "--output-dicom",
            shapes.place("plastimatch", "dicom"),
        ),
    )
    shapes.note("mrtrix", version(["mrconvert", "--version"], r"mrconvert (\S+)"))
    for name in ("volume.nii", "volume.nii.gz", "volume.mif", "volume.mgz", "separate.mih"):
        path = shapes.place("mrtrix", name)
        shapes.attempt(path, lambda: run("mrconvert", "-quiet", "-force", "pydicom/plain", path))


for part in (by_pydicom, by_dcmtk, by_gdcm, from_dicom):
    shapes.attempt(part.__name__, part)
