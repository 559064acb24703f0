() => [...document.querySelectorAll(
    "button, input, select, summary, canvas, iframe, dialog")].filter((one) => {
        if (one.closest("#scene, .dg")) return false;
        const text = !one.matches("select, input") && one.textContent.trim();
        return !(text || one.ariaLabel || one.labels?.[0]?.textContent.trim() ||
            document.getElementById(one.getAttribute("aria-labelledby"))?.textContent);
    }).map((one) => one.outerHTML)
