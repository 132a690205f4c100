//! One HTML page for all that was studied.

use std::fmt::Write;

use super::{Cell, Table, draw, machine};
use crate::{Effort, Findings, StudyError};

const STYLE: &str = "\
body{font:16px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}\
h1,h2{line-height:1.2}table{border-collapse:collapse;margin:1rem 0;font-variant-numeric:tabular-nums}\
caption{text-align:left;font-weight:bold;padding:.3rem 0}th,td{padding:.15rem .7rem;text-align:right;\
border-bottom:1px solid #ddd}th{border-bottom:2px solid #999}td.word{text-align:left}\
svg{max-width:100%;height:auto}footer,.question{color:#666}";

/// The page of some findings, plots inside.
pub(crate) fn html(findings: &[Findings]) -> Result<String, StudyError> {
    let mut page = String::new();
    let mut push = |part: std::fmt::Arguments<'_>| {
        page.write_fmt(part)
            .expect("a string takes all that is written to it");
    };
    push(format_args!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width\">\
         <title>phyxel: studies</title><style>{STYLE}</style></head><body>\n\
         <h1>Error against time</h1>\n"
    ));
    for found in findings {
        let study = found.study;
        push(format_args!(
            "<h2 id=\"{}\">{}</h2>\n<p class=\"question\">{}</p>\n",
            study.name,
            escaped(study.title),
            escaped(study.question)
        ));
        for words in &found.report.words {
            push(format_args!("<p>{}</p>\n", escaped(words)));
        }
        for plot in &found.report.plots {
            push(format_args!("{}\n", draw(plot)?));
        }
        for table in &found.report.tables {
            push(format_args!("{}", rows(table)));
        }
        let effort = match found.effort {
            Effort::Full => "",
            Effort::Quick => " --quick",
        };
        push(format_args!(
            "<footer><code>benches {}{effort}</code>, {:.1} s on {}</footer>\n",
            study.name,
            found.seconds,
            escaped(&machine())
        ));
    }
    push(format_args!("</body></html>\n"));
    Ok(page)
}

fn rows(table: &Table) -> String {
    let mut text = format!("<table><caption>{}</caption>\n<tr>", escaped(&table.title));
    for heading in &table.columns {
        text.push_str(&format!("<th>{}</th>", escaped(heading)));
    }
    text.push_str("</tr>\n");
    for row in &table.rows {
        text.push_str("<tr>");
        for cell in row {
            let class = if matches!(cell, Cell::Word(_)) {
                " class=\"word\""
            } else {
                ""
            };
            text.push_str(&format!("<td{class}>{}</td>", escaped(&cell.to_string())));
        }
        text.push_str("</tr>\n");
    }
    text.push_str("</table>\n");
    text
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}
