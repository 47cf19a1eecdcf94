import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { forgetDrafts, useDraft } from "./draft";

afterEach(() => {
  cleanup();
  forgetDrafts();
});

function Form({ record }: { record: string }) {
  const [text, setText] = useDraft(`form ${record}`, "");
  return <input aria-label="text" value={text} onChange={(event) => setText(event.currentTarget.value)} />;
}

const typed = () => (screen.getByLabelText("text") as HTMLInputElement).value;

it("keeps the input of an unmounted form, per record", () => {
  render(<Form record="a" />);
  fireEvent.change(screen.getByLabelText("text"), { target: { value: "half an assessment" } });
  cleanup();
  render(<Form record="b" />);
  expect(typed()).toBe("");
  cleanup();
  render(<Form record="a" />);
  expect(typed()).toBe("half an assessment");
});

it("discards saved input", () => {
  render(<Form record="a" />);
  fireEvent.change(screen.getByLabelText("text"), { target: { value: "done" } });
  forgetDrafts("form a");
  cleanup();
  render(<Form record="a" />);
  expect(typed()).toBe("");
});
