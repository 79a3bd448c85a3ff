// SPDX-License-Identifier: Apache-2.0
// HDF5 files. (https://docs.hdfgroup.org/hdf5/v1_10)
#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <array>

#include "client/cli/output/result_arrays.h"

namespace dlcs::client {
namespace {

// An object of HDF5, closed with its last use. Negative where it could not be made.
class Hdf5Object {
 public:
  Hdf5Object(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Hdf5Object() {
    if (id_ >= 0) close_(id_);
  }
  Hdf5Object(const Hdf5Object&) = delete;
  Hdf5Object& operator=(const Hdf5Object&) = delete;

  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

// What all datasets are made with; to be closed.
hid_t OpenDatasetCreation() {
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_obj_track_times(creation, false);  // the same result is the same file
  return creation;
}

bool WriteDataset(hid_t file, const char* name, hid_t stored_type, hid_t type, const Hdf5Object& space,
                  const void* data, bool empty) {
  const Hdf5Object creation(OpenDatasetCreation(), H5Pclose);
  const Hdf5Object dataset(H5Dcreate2(file, name, stored_type, space, H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
  return dataset >= 0 && (empty || H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
}

Hdf5Object SpaceOf(const ResultArray& array) {
  const std::array<hsize_t, 2> shape = {array.rows, array.columns};
  return Hdf5Object(H5Screate_simple(array.is_list ? 1 : 2, shape.data(), nullptr), H5Sclose);
}

bool WriteHdf5Array(hid_t file, const ResultArray& array) {
  return WriteDataset(file, array.name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, SpaceOf(array), array.values.data(),
                      array.values.empty());
}

bool NeedsRoom(const ResultArray& array) { return array.values.empty() && array.rows > 0 && array.columns > 0; }

// Returns where its values begin; HADDR_UNDEF if it cannot be made.
haddr_t MakeRoom(hid_t file, const ResultArray& array) {
  const Hdf5Object creation(OpenDatasetCreation(), H5Pclose);
  H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY);
  H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
  const Hdf5Object dataset(
      H5Dcreate2(file, array.name, H5T_NATIVE_DOUBLE, SpaceOf(array), H5P_DEFAULT, creation, H5P_DEFAULT), H5Dclose);
  return dataset >= 0 ? H5Dget_offset(dataset) : HADDR_UNDEF;
}

// Texts of one length, padded with zeros.
bool WriteNames(hid_t file, const char* name, const std::vector<std::string>& names) {
  std::size_t longest = 1;
  for (const std::string& one : names) longest = std::max(longest, one.size());
  std::string padded;
  for (const std::string& one : names) {
    padded += one;
    padded.append(longest - one.size(), '\0');
  }
  const Hdf5Object type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, longest);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const hsize_t count = names.size();
  const Hdf5Object space(H5Screate_simple(1, &count, nullptr), H5Sclose);
  return WriteDataset(file, name, type, type, space, padded.data(), names.empty());
}

// Of variable length: the text itself may be longer than an attribute, which has at most 64 kB.
bool WriteAttribute(hid_t file, const char* name, const std::string& text) {
  const Hdf5Object type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, H5T_VARIABLE);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const Hdf5Object space(H5Screate(H5S_SCALAR), H5Sclose);
  const Hdf5Object attribute(H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const char* const data = text.c_str();
  return attribute >= 0 && H5Awrite(attribute, type, &data) >= 0;
}

// Writes the content of the file, which was built in memory, so that a full disk is reported as for the other formats,
// and no file locks are needed.
absl::Status WriteImage(hid_t file, std::FILE* out) {
  if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0) return absl::InternalError("cannot create an HDF5 file");
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  if (size < 0) return absl::InternalError("cannot create an HDF5 file");
  std::string image(static_cast<std::size_t>(size), '\0');
  if (H5Fget_file_image(file, image.data(), image.size()) != size) {
    return absl::InternalError("cannot create an HDF5 file");
  }
  std::fwrite(image.data(), 1, image.size(), out);
  return absl::OkStatus();  // errors of `out` are reported when it is flushed
}

// Adds to `places` where the values of each array without values begin.
bool WriteContents(hid_t file, const ResultArrays& all, std::map<std::string, std::uint64_t>& places) {
  bool written = file >= 0;
  for (const ResultArray& array : all.arrays) {
    if (!written) break;
    if (!NeedsRoom(array)) {
      written = WriteHdf5Array(file, array);
      continue;
    }
    const haddr_t place = MakeRoom(file, array);
    written = place != HADDR_UNDEF;
    places[array.name] = place;
  }
  for (const auto& [name, names] : all.names) written = written && WriteNames(file, name, names);
  return written && WriteAttribute(file, "summary", all.summary);
}

}  // namespace

absl::StatusOr<std::map<std::string, std::uint64_t>> WriteHdf5WithRoom(const ResultArrays& all,
                                                                       const std::string& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // or it prints its errors
  const Hdf5Object file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT), H5Fclose);
  std::map<std::string, std::uint64_t> places;
  if (!WriteContents(file, all, places) || H5Fflush(file, H5F_SCOPE_GLOBAL) < 0)
    return absl::InternalError("cannot create an HDF5 file");
  return places;
}

absl::Status WriteHdf5(const ResultArrays& all, std::FILE* out) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // or it prints its errors
  const Hdf5Object access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  constexpr std::size_t kGrowth = std::size_t{1} << 20;
  H5Pset_fapl_core(access, kGrowth, /*backing_store=*/0);
  const Hdf5Object file(H5Fcreate("in memory", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  std::map<std::string, std::uint64_t> places;  // none: all values are here
  if (!WriteContents(file, all, places)) return absl::InternalError("cannot create an HDF5 file");
  return WriteImage(file, out);
}

}  // namespace dlcs::client
