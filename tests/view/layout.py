"""Where things are on a page, and which of them lie over each other."""

import itertools

# Of what is seen of the elements that a selector finds: names and boxes.
BOXES = """selector => [...document.querySelectorAll(selector)]
    .filter((one) => one.checkVisibility({visibilityProperty: true}) && one.getClientRects().length)
    .map((one) => ({name: one.id || one.textContent, ...one.getBoundingClientRect().toJSON()}))"""


def overlapping(boxes, slack=0.0):
    """Return the pairs of boxes that share more than `slack` [px] in both directions."""

    def share(a, b, low, high):
        return min(a[high], b[high]) - max(a[low], b[low]) > slack

    pairs = [two for two in itertools.combinations(boxes, 2) if share(*two, "left", "right")]
    return [two for two in pairs if share(*two, "top", "bottom")]
