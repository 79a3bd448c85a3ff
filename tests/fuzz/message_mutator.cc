// SPDX-License-Identifier: Apache-2.0
// Mutations of an input that is a message: a field is set, cleared, grown, or copied from another input. Random changes
// of bytes would rarely give a valid message.

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/message_text.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace dlcs::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;
using Random = std::minstd_rand;

constexpr int kMaxElements = 200;

std::size_t Below(Random& random, std::size_t count) { return random() % count; }

template <typename Value, std::size_t size>
Value OneOf(Random& random, const std::array<Value, size>& values) {
  return values[Below(random, size)];
}

double AnyNumber(Random& random) {
  constexpr double kLargest = std::numeric_limits<double>::max();
  static constexpr std::array kNumbers = {0.0,
                                          -0.0,
                                          1.0,
                                          -1.0,
                                          2.0,
                                          0.5,
                                          -3.0,
                                          1e-3,
                                          1e-12,
                                          1e-300,
                                          1e9,
                                          9.3e18,
                                          1e19,
                                          1e300,
                                          -1e300,
                                          5e-324,
                                          kLargest,
                                          -kLargest,
                                          std::numeric_limits<double>::infinity(),
                                          std::numeric_limits<double>::quiet_NaN()};
  switch (Below(random, 3)) {
    case 0:
      return OneOf(random, kNumbers);
    case 1:
      return static_cast<double>(Below(random, 21)) - 10;
    default:
      return std::uniform_real_distribution(-2.0, 2.0)(random);
  }
}

std::int64_t AnyInteger(Random& random) {
  static constexpr std::array<std::int64_t, 14> kIntegers = {0,
                                                             1,
                                                             2,
                                                             3,
                                                             4,
                                                             5,
                                                             -1,
                                                             8,
                                                             30,
                                                             100,
                                                             65'536,
                                                             std::numeric_limits<std::int32_t>::max(),
                                                             std::numeric_limits<std::int64_t>::max(),
                                                             std::numeric_limits<std::int64_t>::min()};
  return OneOf(random, kIntegers);
}

std::string AnyText(Random& random, std::string text) {
  static const std::array<std::string, 18> kTexts = {"t",
                                                     "0",
                                                     "1",
                                                     "-1",
                                                     "sin(2*t)",
                                                     "1/t",
                                                     "sqrt(-t)",
                                                     "(t<0.5)*2",
                                                     "x1",
                                                     "y1",
                                                     "y1+x1-1",
                                                     "x2-y1**3",
                                                     "max(t,x1)",
                                                     "exp(700*t)",
                                                     "jobs/abcdefghijklmnopqrstuvwx23",
                                                     "2",
                                                     "9223372036854775807",
                                                     ""};
  if (text.empty() || Below(random, 2) == 0) return OneOf(random, kTexts);
  std::vector<std::uint8_t> bytes(text.begin(), text.end());
  bytes.resize(text.size() + 8);
  bytes.resize(LLVMFuzzerMutate(bytes.data(), text.size(), bytes.size()));
  // The text format carries any byte, but strings of proto3 are UTF-8.
  for (std::uint8_t& byte : bytes) byte &= 0x7f;
  return {bytes.begin(), bytes.end()};
}

// Sets a single field, or appends to a repeated one.
void SetAny(Message& message, const FieldDescriptor* field, Random& random) {
  const Reflection& reflection = *message.GetReflection();
  const bool add = field->is_repeated();
  const auto integer = AnyInteger(random);
  switch (field->cpp_type()) {
#define DLCS_SET(Type, value) \
  return add ? reflection.Add##Type(&message, field, value) : reflection.Set##Type(&message, field, value)
    case FieldDescriptor::CPPTYPE_DOUBLE:
      DLCS_SET(Double, AnyNumber(random));
    case FieldDescriptor::CPPTYPE_FLOAT:
      DLCS_SET(Float, static_cast<float>(AnyNumber(random)));
    case FieldDescriptor::CPPTYPE_INT32:
      DLCS_SET(Int32, static_cast<std::int32_t>(integer));
    case FieldDescriptor::CPPTYPE_INT64:
      DLCS_SET(Int64, integer);
    case FieldDescriptor::CPPTYPE_UINT32:
      DLCS_SET(UInt32, static_cast<std::uint32_t>(integer));
    case FieldDescriptor::CPPTYPE_UINT64:
      DLCS_SET(UInt64, static_cast<std::uint64_t>(integer));
    case FieldDescriptor::CPPTYPE_BOOL:
      DLCS_SET(Bool, Below(random, 2) == 1);
    case FieldDescriptor::CPPTYPE_ENUM:
      // One more than there are: an enumerator of a newer version.
      DLCS_SET(EnumValue,
               static_cast<int>(Below(random, static_cast<std::size_t>(field->enum_type()->value_count()) + 1)));
    case FieldDescriptor::CPPTYPE_STRING:
      DLCS_SET(String, AnyText(random, add ? "" : reflection.GetString(message, field)));
#undef DLCS_SET
    case FieldDescriptor::CPPTYPE_MESSAGE:
      add ? reflection.AddMessage(&message, field) : reflection.MutableMessage(&message, field);
  }
}

void ChangeRepeated(Message& message, const FieldDescriptor* field, Random& random) {
  const Reflection& reflection = *message.GetReflection();
  const int size = reflection.FieldSize(message, field);
  const auto index = [&] { return static_cast<int>(Below(random, static_cast<std::size_t>(size))); };
  switch (size == 0 ? 0 : Below(random, 4)) {
    case 0:
      if (size < kMaxElements) SetAny(message, field, random);
      return;
    case 1:
      return reflection.RemoveLast(&message, field);
    case 2:
      return reflection.SwapElements(&message, field, index(), index());
    default:  // an element anew
      SetAny(message, field, random);
      reflection.SwapElements(&message, field, index(), size);
      return reflection.RemoveLast(&message, field);
  }
}

// `message` and all messages in it.
void Collect(Message& message, std::vector<Message*>& all) {
  all.push_back(&message);
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      Collect(*reflection.MutableMessage(&message, field), all);
      continue;
    }
    for (int k = 0; k < reflection.FieldSize(message, field); ++k)
      Collect(*reflection.MutableRepeatedMessage(&message, field, k), all);
  }
}

void Change(Message& root, Random& random) {
  std::vector<Message*> all;
  Collect(root, all);
  Message& message = *all[Below(random, all.size())];
  const auto& type = *message.GetDescriptor();
  if (type.field_count() == 0) return;
  const FieldDescriptor* field =
      type.field(static_cast<int>(Below(random, static_cast<std::size_t>(type.field_count()))));
  if (field->is_repeated()) return ChangeRepeated(message, field, random);
  if (message.GetReflection()->HasField(message, field) && Below(random, 5) == 0)
    return message.GetReflection()->ClearField(&message, field);
  SetAny(message, field, random);
}

// Replaces a part by a part of `other` with the same type.
void Cross(Message& root, Message& other, Random& random) {
  std::vector<Message*> places, parts;
  Collect(root, places);
  Collect(other, parts);
  Message& place = *places[Below(random, places.size())];
  std::erase_if(parts, [&place](const Message* part) { return part->GetDescriptor() != place.GetDescriptor(); });
  if (!parts.empty()) place.CopyFrom(*parts[Below(random, parts.size())]);
}

// 0, which libFuzzer passes over, where it does not fit.
std::size_t Put(const Message& message, std::uint8_t* data, std::size_t max_size) {
  const std::string text = TextOf(message);
  if (text.size() > max_size) return 0;
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

std::string TextAt(const std::uint8_t* data, std::size_t size) { return {reinterpret_cast<const char*>(data), size}; }

}  // namespace
}  // namespace dlcs::fuzz

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using namespace dlcs::fuzz;
  const auto message = MessageOf(TextAt(data, size));
  if (message == nullptr) return LLVMFuzzerMutate(data, size, max_size);
  Random random(seed);
  for (std::size_t changes = 1 + Below(random, 4); changes > 0; --changes) Change(*message, random);
  return Put(*message, data, max_size);
}

extern "C" std::size_t LLVMFuzzerCustomCrossOver(const std::uint8_t* first, std::size_t first_size,
                                                 const std::uint8_t* second, std::size_t second_size, std::uint8_t* out,
                                                 std::size_t max_size, unsigned seed) {
  using namespace dlcs::fuzz;
  const auto message = MessageOf(TextAt(first, first_size));
  const auto other = MessageOf(TextAt(second, second_size));
  if (message == nullptr || other == nullptr) return 0;
  Random random(seed);
  Cross(*message, *other, random);
  return Put(*message, out, max_size);
}
