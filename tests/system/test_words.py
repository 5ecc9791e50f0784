"""tests/lint/words.py finds words of our own in identifiers and in texts for users, and only there."""

import words


def test_parts_of_identifiers_are_found_once_with_their_line():
    text = "int a;\nvoid told_last(TokenBook& kGlow);\ntold_last();\n"

    assert words.violations("x.cpp", text) == [(2, "told_last", "told"), (2, "TokenBook", "book"), (2, "kGlow", "glow")]


def test_comments_texts_and_includes_are_left_alone():
    assert words.violations("x.cpp", '#include "glow.h"\n// told\n/* a book */ f("liar", \'k\', R"(kit)");\nint kitten, mistold;\n') == []


def test_an_exception_holds_for_its_file_alone():
    assert words.violations("worker/render/vdb/vdb_module.cpp", "void say();") == []
    assert words.violations("worker/render/vdb/other.cpp", "void say();") == [(1, "say", "say")]


def test_every_word_of_the_list_can_be_found():
    for word in words.WORDS:
        assert words.violations("x.cpp", f"int {word}_x;") == [(1, f"{word}_x", word)]


def test_phrases_are_found_in_texts_of_each_language():
    assert words.bad_texts("a.cpp", 'f("at most 3 units "\n  "lent at once");\n') == [(1, "lent", "leased")]
    assert words.bad_texts("a.py", 'x = 1\ny = f"job {x} goes on"\n') == [(2, "goes on", "continue")]
    assert words.bad_texts("a.json", '{"description":\n "User who handed it in"}') == [(2, "handed it in", "submit (a job), deliver (a result)")]
    assert words.bad_texts("a.js", 'h("p", `8G say`)') == [(1, "G say", "for example")]


def test_comments_and_names_are_not_texts():
    assert words.bad_texts("a.cpp", '// it was lent\nint told; /* it goes on */ f("leased // twice");\n') == []
    assert words.bad_texts("a.py", "# it was lent\ntold = 1\n") == []
    assert words.bad_texts("a.js", "// goes on\nconst told = 1;\n") == []
