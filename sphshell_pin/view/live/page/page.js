// The page: each module registers for the messages that it needs; then the connection begins.
"use strict";

import { connect, on } from "./connection.js";
import "./theme.js";
import "./notices.js";
import "./scene.js";
import "./panel.js";
import "./transport.js";
import "./parameters.js";
import "./push.js";
import "./view_section.js";
import "./drag.js";
import "./targets.js";
import "./charts.js";
import "./contacts.js";
import { add_help_key } from "./keys.js";

on("state", (data) => { globalThis.state = data; }); // for tests and the console
add_help_key();
connect();
