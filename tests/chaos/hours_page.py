"""The page of the hours of chaos, made of the record of a run."""
import json


def page(path):
    lines = [json.loads(line) for line in open(path, encoding="utf-8")]
    wrong = [f"{line['what']} {line}" for line in lines if line["kind"] == "wrong"]
    return "", wrong
