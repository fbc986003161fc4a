"""The result of a suite as JUnit XML, which CI servers read: a test case per flight."""

from xml.etree import ElementTree

from mambo_codegen.errors import echo
from mambo_sil.experiment.regress.regress_report import RegressSummary


def junit_xml(summary: RegressSummary) -> bytes:
    """Return a summary as JUnit XML; the group of a flight is the class of its test case."""
    name = echo(f"{summary.suite}.{summary.controller}")
    counts = {"tests": str(len(summary.flights)), "failures": str(len(summary.failed)), "errors": "0"}
    root = ElementTree.Element("testsuites", counts)
    suite = ElementTree.SubElement(root, "testsuite", {"name": name, **counts, "skipped": "0"})
    for flight in summary.flights:
        case = ElementTree.SubElement(
            suite, "testcase", {"classname": f"{name}.{flight.group}", "name": flight.name}
        )
        if flight.failures:
            failure = ElementTree.SubElement(case, "failure", {"message": "; ".join(flight.failures)})
            failure.text = f"replay it: mambo-nmpc fly --replay {flight.record}, in the result folder"
    ElementTree.indent(root)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)) + b"\n"
