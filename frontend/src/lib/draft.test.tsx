import { cleanup, fireEvent, render, screen } from "@testing-library/react";
import { afterEach, expect, it } from "vitest";
import { forgetDrafts, useDraft } from "./draft";

afterEach(() => {
  cleanup();
  forgetDrafts();
});

function Form({ of }: { of: string }) {
  const [text, setText] = useDraft(`form ${of}`, "");
  return <input aria-label="text" value={text} onChange={(event) => setText(event.currentTarget.value)} />;
}

const typed = () => (screen.getByLabelText("text") as HTMLInputElement).value;

it("keeps what was typed when its form goes, for this record only", () => {
  render(<Form of="a" />);
  fireEvent.change(screen.getByLabelText("text"), { target: { value: "half an assessment" } });
  cleanup();
  render(<Form of="b" />);
  expect(typed()).toBe("");
  cleanup();
  render(<Form of="a" />);
  expect(typed()).toBe("half an assessment");
});

it("forgets what was saved", () => {
  render(<Form of="a" />);
  fireEvent.change(screen.getByLabelText("text"), { target: { value: "done" } });
  forgetDrafts("form a");
  cleanup();
  render(<Form of="a" />);
  expect(typed()).toBe("");
});
