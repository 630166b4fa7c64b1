#include "base/json_reader.h"

#include "base/error.h"

#include <gtest/gtest.h>

namespace vitrine {
namespace {

std::string message(const std::function<void()>& work) {
    try {
        work();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

TEST(JsonReader, ReadsWhatIsThere) {
    const JsonObject object =
        read_json_text(R"({"a": 1.5, "b": "x", "c": [1, 2, 3], "d": {"e": true}})", "t.json");
    EXPECT_EQ(object.number("a"), 1.5);
    EXPECT_EQ(object.text("b"), "x");
    EXPECT_EQ(object.numbers("c", 3)[2], 3.0);
    EXPECT_TRUE(object.object("d").boolean_or("e", false));
    EXPECT_EQ(object.number_or("missing", 7.0), 7.0);
    object.finish();
}

TEST(JsonReader, UnknownKeyNamesPlaceAndNearest) {
    const std::string text = message([] {
        const JsonObject object = read_json_text("{\n  \"depht_scale\": 5000}", "capture.json");
        object.number_or("depth_scale", 1.0);
        object.finish();
    });
    EXPECT_NE(text.find("capture.json:2:18"), std::string::npos) << text;
    EXPECT_NE(text.find("Did you mean \"depth_scale\"?"), std::string::npos) << text;
}

TEST(JsonReader, MalformedDuplicateDeep) {
    EXPECT_NE(message([] { read_json_text("{\"a\": 1,\n \"b\" 2}", "t"); }).find("t:2:"),
              std::string::npos);
    EXPECT_NE(message([] { read_json_text("{\"a\": 1, \"a\": 2}", "t"); }).find("each key once"),
              std::string::npos);
    const std::string deep = "{\"a\":" + std::string(100000, '[') + std::string(100000, ']') + "}";
    EXPECT_NE(message([&] { read_json_text(deep, "t"); }).find("nesting"), std::string::npos);
    EXPECT_NE(message([] { read_json_text("", "t"); }).find("an empty file"), std::string::npos);
}

TEST(JsonReader, WrongTypeSaysWhatWasThere) {
    const std::string text = message(
        [] { read_json_text("{\"a\": {\"n\": \"twelve\"}}", "t").object("a").number("n"); });
    EXPECT_EQ(text, "t:1:13: expected \"n\" to be a number, found \"twelve\".");
}

}  // namespace
}  // namespace vitrine
